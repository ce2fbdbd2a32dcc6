"""Display of the results of a press: a picture, drawn without a display, or a window."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from finger3d._extras import available
from finger3d.errors import MissingError
from finger3d.fem.mesh import FREE_FACES, Mesh
from finger3d.mechanics.readings import Gauge
from finger3d.plotting.deformed import draw_finger
from finger3d.plotting.gauges import Mark, marks_of
from finger3d.plotting.layout import save
from finger3d.plotting.renderer import running_child
from finger3d.plotting.solid import DeformedFinger
from finger3d.results.states import States, captions, load_states
from finger3d.results.summary import gauges_of, press_summary


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


def show(folder: str | Path, png: str | Path, step: int | None = None) -> None:
    """Write a picture of one step of a result: contact pressure, stick and slip.

    Parameters
    ----------
    folder : results folder of a press
    step : number of the step, from 1; None for the last

    Raises
    ------
    Finger3dError
        If the folder or the step does not exist, or the file cannot be written.
    """
    states, title, gauges = found(folder)
    k = len(states.step) - 1 if step is None else states.index(step, folder)
    mesh = mesh_of(states)
    marks = marks_of(mesh, gauges, near=mesh.dim == 3)
    save(draw_finger(finger_of(states, k, mesh, f"{title}\n{captions(states)[k]}", marks)), png)


def has_window() -> bool:
    """Whether a window can be opened: with PyVista, and on Linux with a display."""
    displays = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return available("pyvista") and (not sys.platform.startswith("linux") or bool(displays))


def show_window(folder: str | Path) -> None:
    """Open a window and return when it is closed; it runs in a child process, as a faulty OpenGL driver may crash it.

    Raises
    ------
    MissingError
        If no window can be opened.
    """
    found(folder)
    command = [sys.executable, "-P", "-m", "finger3d.plotting.window", str(Path(folder).resolve())]
    with running_child(command, window=True) as outcome:
        why = outcome()
    if why is not None:
        raise MissingError(f"show: no window could be opened: {why}; add --png FILE for a picture")
