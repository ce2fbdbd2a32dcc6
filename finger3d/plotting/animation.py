"""Pictures and animations of the steps of a press: contact pressure on the left, stick and slip on the right.

All frames share one camera and one scale of pressure.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d.fem.mesh.simplex import FREE_FACES, Mesh
from finger3d.io import atomic
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.plotting.deformed import DeformedFinger, draw_fingers
from finger3d.plotting.gauges import marks_of
from finger3d.plotting.renderer import WINDOW
from finger3d.results.states import States

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image


_DPI = 65  # pixels per inch of an animation
_FRAME_MS, _LAST_MS = 450, 1500  # duration of a frame and of the last frame of an animation
_WINDOW = 1000, 750  # width and height of rendered frames of an animation, in pixels


def frames(states: States, numbers: Sequence[int], title: str, gauges: Sequence[Gauge] = ()) -> list[Figure]:
    """Return figures of some of the stored steps, with one camera and one scale of pressure.

    Parameters
    ----------
    states : stored steps of a press
    numbers : indices of the stored steps to draw, from 0
    title : title of the scene
    gauges : gauges to mark in every frame
    """
    from finger3d.results.states import captions

    names = captions(states)
    titles = [f"{title}\n{names[k]}" for k in numbers]
    mesh = mesh_of(states)
    marks = marks_of(mesh, gauges, near=mesh.dim == 3)
    fingers = []
    for k, title_of_step in zip(numbers, titles, strict=True):
        fingers.append(
            DeformedFinger(
                mesh=mesh,
                displacement=states.displacement[k].astype(float),
                pressure=states.pressure[k],
                shear=np.column_stack([states.shear_x[k], states.shear_y[k], states.shear_z[k]]),
                status=states.status[k].astype(int),
                nodes=states.nodes,
                faces=states.face,
                thing=states.object_at(k),
                title=title_of_step,
                marks=marks,
            )
        )
    return draw_fingers(fingers, _WINDOW if len(fingers) > 1 else WINDOW, arrows=False)[0]


def mesh_of(states: States) -> Mesh:
    """Return the undeformed mesh of the whole finger; the facets that cannot touch are labelled body."""
    labels = [*enumerate(FREE_FACES), (-1, "body")]
    facets = {label: states.facets[states.facet_face == k].astype(int) for k, label in labels}
    part = states.part.astype(int) if states.part.any() else None
    return Mesh(states.points.astype(float), states.cells.astype(int), facets, part)


def write_gif(path: str | Path, figures: Sequence[Figure]) -> None:
    """Write the frames as an animation that repeats and holds its last frame longer."""
    images = [_pixels(figure) for figure in figures]
    durations = [_FRAME_MS] * (len(images) - 1) + [_LAST_MS]
    with atomic(path) as temporary:
        images[0].save(temporary, "GIF", save_all=True, append_images=images[1:], duration=durations, loop=0)


def _pixels(figure: Figure) -> Image:
    from PIL import Image

    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_DPI)
    # The octree method preserves the colours of small areas, such as the legend.
    return Image.open(stream).convert("RGB").quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
