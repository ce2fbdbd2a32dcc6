"""Display of the results of a press: an interactive window, or pictures and an animation without a display.

In pictures the contact pressure is on the left, stick and slip on the right; all frames share one camera and one scale
of pressure.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d._extras import require
from finger3d.errors import MissingError
from finger3d.fem.mesh.simplex import FREE_FACES, Mesh
from finger3d.io import atomic
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.plotting.deformed import draw_fingers
from finger3d.plotting.gauges import Mark, marks_of
from finger3d.plotting.renderer import WINDOW
from finger3d.plotting.solid import DeformedFinger
from finger3d.results.states import States, load_states
from finger3d.results.summary import gauges_of, press_summary

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
    fingers = [finger_of(states, k, mesh, name, marks) for k, name in zip(numbers, titles, strict=True)]
    return draw_fingers(fingers, _WINDOW if len(fingers) > 1 else WINDOW, arrows=False)[0]


def finger_of(states: States, k: int, mesh: Mesh, title: str = "", marks: Sequence[Mark] = ()) -> DeformedFinger:
    """Return the finger at the k-th kept increment; `mesh` is that of `mesh_of`."""
    return DeformedFinger(
        mesh=mesh,
        displacement=states.displacement[k].astype(float),
        pressure=states.pressure[k],
        shear=np.column_stack([states.shear_x[k], states.shear_y[k], states.shear_z[k]]),
        status=states.status[k].astype(int),
        nodes=states.nodes,
        faces=states.face,
        thing=states.object_at(k),
        title=title,
        marks=marks,
        zones=states.zones(k),
    )


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


def found(folder: str | Path) -> tuple[States, str, list[Gauge]]:
    """Read the stored steps of a results folder, and the title and the gauges of its scene.

    Raises
    ------
    Finger3dError
        If the folder holds no results of a press, or they are damaged.
    MissingError
        If the press was interrupted, so that there are numbers but no fields.
    """
    folder = Path(folder)
    summary = press_summary(folder)
    if not (folder / "steps.npz").exists():
        why = " ".join(summary["outcome"].split())
        raise MissingError(f"{folder}: has no fields to show; its outcome is: {why}; press {folder}/scene.toml again")
    scene = summary["scene"]
    return load_states(folder / "steps.npz"), scene.get("title") or folder.name, gauges_of(scene)


def show(
    folder: str | Path, png: str | Path | None = None, gif: str | Path | None = None, step: int | None = None
) -> None:
    """Write a picture and an animation of a result; neither needs a display.

    Parameters
    ----------
    folder : results folder of a press
    png : file for a picture of one step: contact pressure, stick and slip
    gif : file for an animation of all stored steps, with one scale of pressure
    step : number of the step in the picture, from 1; None for the last

    Raises
    ------
    Finger3dError
        If the folder or the step does not exist, or a file cannot be written.
    """
    from finger3d.plotting.layout import save

    states, title, gauges = found(folder)
    if png is not None:
        k = len(states.step) - 1 if step is None else states.index(step, folder)
        save(frames(states, [k], title, gauges)[0], png)
    if gif is not None:
        write_gif(gif, frames(states, range(len(states.step)), title, gauges))


def show_window(folder: str | Path) -> None:
    """Open a window and return when it is closed; it runs in a child process, as a faulty OpenGL driver may crash it.

    Raises
    ------
    MissingError
        If there is no display or no window can be opened.
    """
    from finger3d.plotting.renderer import run_child

    found(folder)
    require("show: a window", "pyvista", instead="add --png FILE for a picture")
    linux = sys.platform.startswith("linux")
    if linux and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise MissingError(
            "show: there is no display here; add --png FILE for a picture, or --gif FILE for the increments"
        )
    why = run_child([sys.executable, "-P", "-m", "finger3d.plotting.window", str(Path(folder).resolve())], window=True)
    if why is not None:
        raise MissingError(f"show: no window could be opened: {why}; add --png FILE for a picture")
