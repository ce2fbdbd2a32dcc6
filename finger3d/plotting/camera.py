"""Camera of the pictures of a solid: an oblique parallel projection, and the crop of the rendered window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float

WINDOW = (1600, 1200)
"""Width and height of the window that PyVista renders, in pixels."""

_VIEW = np.array([-0.45, 1.05, 1.0])  # direction towards the viewer: in front, above, slightly left
_MARGIN = 1.04  # height of the window over that of its contents
_WHITE = 250  # least grey level of the background, of 255


def viewer_axes(direction: Float) -> Float:
    """Return the axes of a viewer in a direction (3,) from the scene: rows (3, 3) right, up, and towards the viewer."""
    towards = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 1.0, 0.0], towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


AXES = viewer_axes(_VIEW)
"""Orthonormal axes of the viewer, rows (3, 3): right, up, and towards the viewer."""


def flat(points: Float) -> Float:
    """Project points, shape (..., 3), onto the picture plane, shape (..., 2), mm."""
    return points @ AXES[:2].T


def half_height(size: Float) -> float:
    """Return half the height of a window, in mm, that holds the given width and height (2,), in mm."""
    return float(0.5 * _MARGIN * max(size[1], size[0] * WINDOW[1] / WINDOW[0]))


def framed(
    images: NDArray[np.uint8], frame: tuple[Float, Float]
) -> tuple[NDArray[np.uint8], tuple[float, float, float, float]]:
    """Crop the common white margins of images.

    Parameters
    ----------
    images : (s, h, w, 3) array
        Images of one window.
    frame : tuple of (3,) and (2,) array, mm
        Centre of the window, and the width and height that it holds.

    Returns
    -------
    images : (s, h', w', 3) array
        Cropped images.
    extent : tuple of four floats, mm
        Left, right, lower and upper edge of the cropped images in the picture plane of `flat`.
    """
    kept, (top, left) = _cropped(images)
    middle, size = frame
    pixel = 2.0 * half_height(size) / images.shape[1]
    x, y = flat(middle) + pixel * np.array([left - 0.5 * images.shape[2], 0.5 * images.shape[1] - top])
    return kept, (x, x + pixel * kept.shape[2], y - pixel * kept.shape[1], y)


def _cropped(images: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], tuple[int, int]]:
    """Return images (s, h, w, 3) without their common white margins, and the first row and column kept."""
    stack = images[..., :3]
    inked = np.min(stack, axis=(0, 3)) < _WHITE
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    kept = stack[:, rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return kept, (int(rows[0]), int(columns[0]))
