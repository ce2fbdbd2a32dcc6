"""Pictures and animations of the steps of a press: contact pressure on the left, stick and slip on the right.

All frames share one camera and one scale of pressure.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d.fem.simplex import FREE_FACES, Mesh
from finger3d.io import atomic
from finger3d.mechanics.gauges import Gauge
from finger3d.plotting.camera import WINDOW
from finger3d.plotting.deformed import DeformedFinger, draw_fingers
from finger3d.plotting.gauges import marks_of
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
<<<<<<< HEAD
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
=======
    found = marks_of(mesh, gauges, near=mesh.dim == 3)
    marks = [[(mark.label, mark.of(states.points + states.displacement[k])) for mark in found] for k in numbers]
    if states.dim == 2:
        return _sections(states, numbers, titles, highest, marks)
    skins, colours = [], []
    for k in numbers:
        shear = np.column_stack([states.shear_x[k], states.shear_y[k], states.shear_z[k]])
        u = states.displacement[k].astype(float)
        thing = states.object_at(k)
        status = states.status[k].astype(int)
        skin = skin_of(mesh, u, states.pressure[k], shear, status, states.nodes, states.face, thing)
        skins.append(skin)
        by_status = np.repeat(view.palette()[skin.status][:, None], 3, axis=1)
        colours.append((view.pressure_colours(skin.pressure, highest, skin.status[:, None]), by_status))
    return _solids(skins, colours, titles, highest, marks)
>>>>>>> w1


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
<<<<<<< HEAD
=======


def _sections(
    states: States, numbers: Sequence[int], titles: Sequence[str], highest: float, marks: Sequence[view.Marks]
) -> list[Figure]:
    """Draw steps of a 2D model."""
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.patches import PathPatch

    moved = states.points + states.displacement[list(numbers)]
    everywhere = np.concatenate([states.points[None], moved]).reshape(-1, 2)
    low, span = everywhere.min(axis=0), np.ptp(everywhere, axis=0)
    arc, outline = states.facets[states.on_contact], states.facets[:, :2]
    corners, mesh = states.cells[:, :3], mesh_of(states)
    figures = []
    for k, at, title, lines in zip(numbers, moved, titles, marks, strict=True):
        middle = at[arc[:, 2]] if arc.shape[1] == 3 else at[arc].mean(axis=1)
        halves = np.stack([at[arc[:, :2]], np.repeat(middle[:, None], 2, axis=1)], axis=2).reshape(-1, 2, 2)
        pressure, status = (states.on_points(name, k)[arc[:, :2]].ravel() for name in ("pressure", "status"))
        by_pressure = view.pressure_colours(pressure, highest, status)
        figure, panels = view.two_panels(1.15 * span[1] / span[0], title, ticks=True)
        for axes, colours in zip(panels, (by_pressure, view.palette()[status.astype(int)]), strict=True):
            axes.add_collection(PolyCollection(list(at[corners]), facecolor=BODY, edgecolor=BODY, lw=0.3))
            axes.add_collection(LineCollection(list(states.points[outline]), colors=REST, lw=0.8, linestyles=":"))
            axes.add_collection(LineCollection(list(at[outline]), colors=LINE, lw=0.8))
            axes.add_artist(PathPatch(interfaces_of(mesh, at), facecolor="none", edgecolor=FEATURE, lw=0.9))
            axes.add_collection(LineCollection(list(view.sliced(states.object_at(k))), colors=OBJECT, lw=1.0))
            axes.add_collection(LineCollection(list(halves), colors=colours, lw=5, capstyle="butt", zorder=3))
            axes.set(xlim=low[0] + span[0] * np.array([-0.04, 1.04]), ylim=low[1] + span[1] * np.array([-0.04, 1.1]))
            axes.set_xlabel("x (mm)", labelpad=1)
        panels[0].set_ylabel("y (mm)")
        draw_marks(panels[0], lines)
        view.keys(figure, highest, {"finger at rest": REST, "object": OBJECT})
        figures.append(figure)
    return figures


def _solids(
    skins: Sequence[Skin],
    colours: Sequence[tuple[Float, Float]],
    titles: Sequence[str],
    highest: float,
    marks: Sequence[view.Marks],
) -> list[Figure]:
    """Draw steps of a solid."""
    pictures = [(skin, shade, False) for skin, both in zip(skins, colours, strict=True) for shade in both]
    window = _WINDOW["picture" if len(skins) == 1 else "animation"]
    images, extent = render_solids(pictures, window) or (None, None)
    seen = np.concatenate([flat(skin.points) for skin in skins])
    low, span = seen.min(axis=0), np.ptp(seen, axis=0)
    aspect = float(span[1] / span[0]) if images is None else images[0].shape[0] / images[0].shape[1]
    figures = []
    for k, title in enumerate(titles):
        figure, panels = view.two_panels(aspect, title)
        for number, axes in enumerate(panels):
            if images is not None:
                axes.imshow(images[2 * k + number], interpolation="antialiased", extent=extent)
            else:
                draw_solid(axes, skins[k], colours[k][number], arrows=False)
                axes.set(xlim=(low[0], low[0] + span[0]), ylim=(low[1], low[1] + span[1]))
            axes.set_axis_off()
        draw_marks(panels[0], [(name, flat(line)) for name, line in marks[k]])
        view.keys(figure, highest, {"finger at rest": REST, "object": OBJECT_TINT})
        figures.append(figure)
    return figures
>>>>>>> w1
