"""Deformed fingers drawn to scale: contact pressure on the left, stick and slip on the right.

Solids are rendered by PyVista in a child process, because VTK aborts the process if no OpenGL driver works. In that
case, and with ``FINGER3D_RENDERER=matplotlib``, matplotlib draws them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float, Int
from finger3d.contact.friction import OPEN
from finger3d.contact.zones import border_shares
from finger3d.fem.mesh.simplex import CONTACT, FREE_FACES
from finger3d.plotting.gauges import draw_marks
from finger3d.plotting.panels import (
    edges_of,
    highest_of,
    interfaces_of,
    keys,
    outline_of,
    palette,
    pressure_colours,
    sliced,
    two_panels,
)
from finger3d.plotting.renderer import WINDOW, flat
from finger3d.plotting.solid import (
    BODY,
    FEATURE,
    LINE,
    OBJECT,
    OBJECT_TINT,
    REST,
    DeformedFinger,
    Rendered,
    Skin,
    draw_solid,
    rendering_solids,
    seen_box,
    skin_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_fingers(
    fingers: Sequence[DeformedFinger], window: tuple[int, int] = WINDOW, arrows: bool = True
) -> tuple[list[Figure], str]:
    """Return figures of one finger at several steps, and their renderer; see `drawing_fingers`."""
    with drawing_fingers(fingers, window, arrows) as drawn:
        return drawn()


@contextmanager
def drawing_fingers(
    fingers: Sequence[DeformedFinger], window: tuple[int, int] = WINDOW, arrows: bool = True
) -> Iterator[Callable[[], tuple[list[Figure], str]]]:
    """Draw one finger at several steps, with one camera and one scale of pressure.

    Solids are rendered beside what else is done within the block.

    Parameters
    ----------
    fingers : the steps
    window : width and height of rendered solids, in pixels
    arrows : whether friction on solids is drawn

    Yields
    ------
    function that returns the figures, one for each step, and the renderer: ``pyvista`` or ``matplotlib``
    """
    highest = highest_of(np.concatenate([finger.pressure for finger in fingers]))
    if fingers[0].mesh.dim == 2:
        yield lambda: (_sections(fingers, highest), "matplotlib")
        return
    skins = [skin_of(finger) for finger in fingers]
    pictures = []
    for skin in skins:
        by_status = np.repeat(palette()[skin.status][:, None], 3, axis=1)
        pictures += [
            (skin, pressure_colours(skin.pressure, highest, skin.status[:, None]), False),
            (skin, by_status, arrows),
        ]
    with rendering_solids(pictures, window) as rendered:
        yield lambda: _solids(fingers, highest, pictures, rendered())


def _sections(fingers: Sequence[DeformedFinger], highest: float) -> list[Figure]:
    """Draw a 2D model, with the pressure and the status along the faces that may touch."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import PathPatch

    mesh = fingers[0].mesh
    everywhere = np.concatenate([mesh.points, *(finger.moved for finger in fingers)])
    low, span = everywhere.min(axis=0), np.ptp(everywhere, axis=0)
    rest, figures = outline_of(mesh, mesh.points), []
    for finger in fingers:
        halves, pressure, status = coloured_halves(finger)
        figure, panels = two_panels(1.14 * span[1] / (1.08 * span[0]), finger.title, ticks=True)
        paths = [draw(mesh, finger.moved) for draw in (outline_of, edges_of, interfaces_of)]
        lines = [(paths[0], BODY, LINE, 0.5), (paths[1], "none", LINE, 0.25), (paths[2], "none", FEATURE, 0.9)]
        for axes, colours in zip(panels, (pressure_colours(pressure, highest, status), palette()[status]), strict=True):
            for path, face, edge, width in lines:
                axes.add_artist(PathPatch(path, facecolor=face, edgecolor=edge, lw=width))
            axes.add_artist(PathPatch(rest, facecolor="none", edgecolor=REST, lw=0.8, ls=":"))
            if finger.thing is not None:
                axes.add_collection(LineCollection(list(sliced(finger.thing)), colors=OBJECT, lw=1.2, zorder=2))
            axes.add_collection(LineCollection(list(halves), colors=colours, lw=5, capstyle="butt", zorder=3))
            axes.set(xlim=low[0] + span[0] * np.array([-0.04, 1.04]), ylim=low[1] + span[1] * np.array([-0.04, 1.1]))
            axes.set_xlabel("x (mm)", labelpad=1)
            axes.spines[["top", "right"]].set_visible(False)
        panels[0].set_ylabel("y (mm)")
        draw_marks(panels[0], finger.lines)
        keys(figure, highest, {"finger at rest": REST} | ({} if finger.thing is None else {"object": OBJECT}))
        figures.append(figure)
    return figures


def coloured_halves(finger: DeformedFinger) -> tuple[Float, Float, Int]:
    """Return both parts (h, 2, 2) of every facet that may touch, the mean pressure (h,) and the status (h,) of each.

    They meet where the status changes; that of a part is that of its end.
    """
    mesh, moved = finger.mesh, finger.moved
    halves, pressure, status = [], [], []
    for k in np.union1d(finger.faces, CONTACT):
        arc, own = mesh.facets.get(FREE_FACES[k], mesh.facets["contact"][:0]), finger.faces == k
        value, state = np.zeros(len(moved)), np.full(len(moved), OPEN)
        value[finger.nodes[own]], state[finger.nodes[own]] = finger.pressure[own], finger.status[own]
        point = np.full(len(moved), -1)
        point[finger.nodes[own]] = np.flatnonzero(own)
        share = border_shares(point[arc[:, :2]], finger.status, finger.zones)[:, None]
        middle = moved[arc[:, 2]] if mesh.element.is_quadratic else moved[arc].mean(axis=1)
        start, end = moved[arc[:, 0]], moved[arc[:, 1]]
        middle = (
            (1 - share) * (1 - 2 * share) * start + 4 * share * (1 - share) * middle + share * (2 * share - 1) * end
        )
        pairs = np.stack([moved[arc[:, :2]], np.repeat(middle[:, None], 2, axis=1)], axis=2)
        halves.append(pairs.reshape(-1, 2, 2))
        pressure.append((0.75 * value[arc[:, :2]] + 0.25 * value[arc[:, 1::-1]]).ravel())
        status.append(state[arc[:, :2]].ravel())
    return np.concatenate(halves), np.concatenate(pressure), np.concatenate(status)


def _solids(
    fingers: Sequence[DeformedFinger],
    highest: float,
    pictures: Sequence[tuple[Skin, Float, bool]],
    rendered: Rendered | None,
) -> tuple[list[Figure], str]:
    """Draw a solid from its two pictures at each step; where they are not rendered, by matplotlib."""
    images, extent = rendered or (None, None)
    skins, arrows = [skin for skin, _, _ in pictures[::2]], pictures[-1][-1]
    low, span = seen_box(skins)
    aspect = float(span[1] / span[0]) if images is None else images[0].shape[0] / images[0].shape[1]
    figures = []
    for k, (finger, skin) in enumerate(zip(fingers, skins, strict=True)):
        figure, panels = two_panels(aspect, finger.title)
        for number, axes in enumerate(panels, start=2 * k):
            if images is not None:
                axes.imshow(images[number], interpolation="antialiased", extent=extent)
            else:
                draw_solid(axes, *pictures[number])
                axes.set(xlim=(low[0], low[0] + span[0]), ylim=(low[1], low[1] + span[1]))
            axes.set_axis_off()
        draw_marks(panels[0], [(label, flat(line)) for label, line in finger.lines])
        if finger.marks:
            panels[0].set_title("contact pressure; gauges projected onto the front face", fontsize=11)
        if arrows and skin.largest_shear > 0.0:
            text = f"stick and slip; arrows: friction on the finger, at most {skin.largest_shear:.3g} MPa"
            panels[1].set_title(text, fontsize=11)
        keys(figure, highest, {"finger at rest": REST} | ({"object": OBJECT_TINT} if len(skin.thing) else {}))
        figures.append(figure)
    return figures, "matplotlib" if images is None else "pyvista"
