"""From where a solid is looked at, and what of the window is kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

WINDOW = (1600, 1200)
"""Width and height of what PyVista renders, pixels."""

_VIEW = np.array([-0.45, 1.05, 1.0])  # From where the finger is looked at: above, in front, a little from the left.
_MARGIN = 1.04


def _viewer_axes() -> Float:
    """Rows: to the right, up, and towards the viewer."""
    towards = _VIEW / np.linalg.norm(_VIEW)
    right = np.cross([0.0, 1.0, 0.0], towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


AXES = _viewer_axes()
"""Rows (3, 3): to the right, up, and towards the viewer."""


def flat(points: Float) -> Float:
    """Points (..., 3) as the viewer sees them, (..., 2)."""
    return points @ AXES[:2].T


def half_height(size: Float) -> float:
    """Half the height (mm) of a window that holds this width and height (mm)."""
    return float(0.5 * _MARGIN * max(size[1], size[0] * WINDOW[1] / WINDOW[0]))


def framed(
    images: NDArray[np.uint8], frame: tuple[Float, Float]
) -> tuple[NDArray[np.uint8], tuple[float, float, float, float]]:
    """Images (s, h, w, 3) of a window around a frame, middle (3,) and width and height (2,), without white margins; and
    the left, right, lower and upper end of what is kept, mm as `flat` gives them.
    """
    kept, (top, left) = _cropped(images)
    middle, size = frame
    pixel = 2.0 * half_height(size) / images.shape[1]
    x, y = flat(middle) + pixel * np.array([left - 0.5 * images.shape[2], 0.5 * images.shape[1] - top])
    return kept, (x, x + pixel * kept.shape[2], y - pixel * kept.shape[1], y)


def _cropped(images: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], tuple[int, int]]:
    """Images (s, h, w, 3) without the margin that all of them leave white, and the first row and column kept."""
    stack = images[..., :3]
    inked = np.min(stack, axis=(0, 3)) < 250
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    kept = stack[:, rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return kept, (int(rows[0]), int(columns[0]))
