"""Pictures of the steps of casting, without labels, for the page of a mold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finger3d.geometry.surface import Triangles
from finger3d.plotting.layout import blank, save
from finger3d.plotting.mold import rendered, scenery, show

_STANDING = np.array([0.55, 0.5, 1.0])  # direction towards the viewer, y up
_LYING = np.array([0.1, 1.0, 0.7])  # of parts on the bed, from above

_WIDTH, _DPI = 6.0, 110  # inches, pixels per inch


@dataclass(frozen=True)
class StepPicture:
    """Picture of a step.

    Attributes
    ----------
    path : PNG file
    parts : surfaces, mm, by the names of parts, y up, or z up on the bed
    on_bed : whether the parts lie on the bed of the printer
    """

    path: Path
    parts: Mapping[str, Triangles]
    on_bed: bool = False


def step_pictures(pictures: Sequence[StepPicture]) -> str:
    """Write the pictures of all steps, in one run of the renderer; returns the renderer."""
    views = [scenery(_y_up(p), _LYING, opaque=True) if p.on_bed else scenery(p.parts, _STANDING) for p in pictures]
    images = rendered(views)
    for i, (one, view) in enumerate(zip(pictures, views, strict=True)):
        width, height = view.half
        figure = blank(_WIDTH, float(_WIDTH * height / width))
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        show(axes, view, None if images is None else images[i])
        save(figure, one.path, _DPI)
    return "matplotlib" if images is None else "pyvista"


def _y_up(picture: StepPicture) -> dict[str, Triangles]:
    """Return parts on a bed (z up) with y up, as the camera stands."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return {name: Triangles(part.points @ turn.T, part.faces) for name, part in picture.parts.items()}
