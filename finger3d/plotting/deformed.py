"""A deformed finger drawn to scale: contact pressure on the left, stick and slip on the right."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float, Int
from finger3d.contact.friction import OPEN
from finger3d.contact.zones import border_shares
from finger3d.fem.mesh import CONTACT, FREE_FACES
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
from finger3d.plotting.renderer import flat
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
    rendering_solid,
    skin_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_finger(finger: DeformedFinger) -> Figure:
    """Return a figure of a finger; see `drawing_finger`."""
    with drawing_finger(finger) as drawn:
        return drawn()


@contextmanager
def drawing_finger(finger: DeformedFinger) -> Iterator[Callable[[], Figure]]:
    """Draw a finger; a solid is rendered beside what else is done within the block.

    Yields
    ------
    function that returns the figure
    """
    highest = highest_of(finger.pressure)
    if finger.mesh.dim == 2:
        yield lambda: _section(finger, highest)
        return
    skin = skin_of(finger)
    by_pressure = pressure_colours(skin.pressure, highest, skin.status[:, None])
    by_status = np.repeat(palette()[skin.status][:, None], 3, axis=1)
    with rendering_solid(skin, by_pressure, by_status) as rendered:
        yield lambda: _solid(finger, highest, skin, rendered())


def _section(finger: DeformedFinger, highest: float) -> Figure:
    """Draw a 2D model, with the pressure and the status along the faces that may touch."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import PathPatch

    mesh = finger.mesh
    everywhere = np.concatenate([mesh.points, finger.moved])
    low, span = everywhere.min(axis=0), np.ptp(everywhere, axis=0)
    rest = outline_of(mesh, mesh.points)
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
    return figure


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


def _solid(finger: DeformedFinger, highest: float, skin: Skin, rendered: Rendered) -> Figure:
    """Draw a solid from its two pictures."""
    images, extent = rendered
    figure, panels = two_panels(images[0].shape[0] / images[0].shape[1], finger.title)
    for axes, image in zip(panels, images, strict=True):
        axes.imshow(image, interpolation="antialiased", extent=extent)
        axes.set_axis_off()
    draw_marks(panels[0], [(label, flat(line)) for label, line in finger.lines])
    if finger.marks:
        panels[0].set_title("contact pressure; gauges projected onto the front face", fontsize=11)
    if skin.largest_shear > 0.0:
        text = f"stick and slip; arrows: friction on the finger, at most {skin.largest_shear:.3g} MPa"
        panels[1].set_title(text, fontsize=11)
    keys(figure, highest, {"finger at rest": REST} | ({"object": OBJECT_TINT} if len(skin.thing) else {}))
    return figure
