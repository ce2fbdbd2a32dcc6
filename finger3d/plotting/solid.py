"""Surface of a deformed solid, and its picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int, freeze_arrays
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.zones import FACET_SIDES, Zone, facet_borders
from finger3d.fem.mesh import CONTACT, FREE_FACES, TRI3, TRI6, TRIANGLES, Mesh, part_of_facets
from finger3d.plotting.gauges import Mark
from finger3d.plotting.renderer import (
    AXES,
    WINDOW,
    Arrows,
    Camera,
    Drawing,
    Image,
    Polygons,
    Polylines,
    flat,
    framed,
    half_height,
    rendering,
    unshared,
)

BODY, LINE, FEATURE, REST, OBJECT = "#d9d6cf", "#8d8a84", "#444444", "#777777", "#222222"
COLOURS = {OPEN: "#c4c4c4", STICK: "#1f3f77", SLIP: "#f28e2b"}
OBJECT_TINT, OBJECT_OPACITY = "#7fa7c9", 0.12
ARROWS = {STICK: "#ffffff", SLIP: "#000000"}
"""Contact status -> colour of friction arrows."""

_ARROW_LENGTH = 0.045  # of the longest arrow, relative to the largest extent of the finger
_ARROW_SPACINGS = 1.6  # largest length of an arrow, in multiples of the distance between arrows
_ARROW_COUNT = 100.0  # approximate number of arrows

# A quadratic facet is split into six triangles by a point of each side, where the status changes: one at each corner,
# with its status, and three around their centre (node 6), which have the status that most corners have. A boundary of a
# status is thus straight across a facet.
_SIX = np.array([[0, 3, 5], [1, 4, 3], [2, 5, 4], [3, 4, 6], [4, 5, 6], [5, 3, 6]])
_RING = np.array([0, 3, 1, 4, 2, 5])
_SIDES = np.array([[0, 3, 1], [1, 4, 2], [2, 5, 0]])


@dataclass(frozen=True, kw_only=True)
class DeformedFinger:
    """A finger at one increment of a press.

    Attributes
    ----------
    mesh : undeformed mesh of the whole finger (unfolded, if symmetry was used), mm
    displacement : (n, d) mm
    pressure, shear : (c,) and (c, 3) MPa, at the contact points; the shear is the friction on the finger
    status : (c,) status of these points
    nodes, faces : (c,) their nodes, and the numbers in `finger3d.fem.mesh.FREE_FACES` of their faces
    thing : (t, 3, 3) corners of the object's triangles, mm; None without it
    title : of the picture
    marks : gauges, from `finger3d.plotting.gauges.marks_of`
    zones : of contact and of stick, by which their borders are drawn between the points; None: midway
    """

    mesh: Mesh
    displacement: Float
    pressure: Float
    shear: Float
    status: Int
    nodes: Int
    faces: Int
    thing: Float | None
    title: str = ""
    marks: Sequence[Mark] = ()
    zones: tuple[Zone, Zone] | None = None

    @property
    def moved(self) -> Float:
        """Positions (n, d) of the nodes, mm."""
        return self.mesh.points + self.displacement

    @property
    def lines(self) -> list[tuple[str, Float]]:
        """Labels of the gauges and their lines (3, d), mm."""
        return [(mark.label, mark.of(self.moved)) for mark in self.marks]


@dataclass(frozen=True)
class Skin:
    """Surfaces, lines and arrows of the picture of a solid, deformed, mm.

    Attributes
    ----------
    body : (b, 6, 3) facets of the other faces, nodes in VTK's order
    contact : (t, 3, 3) triangles of the faces that may touch
    pressure : (t, 3) contact pressure at their corners, MPa
    status : (t,) status of the contact point that each triangle belongs to
    lines : (k, 3, 3) edges of the facets of the body: end, middle, end
    features : (k, 3, 3) edges between the faces of the body, and between its parts on them
    rest : (k, 3, 3) edges of the undeformed contact surface
    thing : (k, 3, 3) triangles of the object; none without one
    arrow_at : (a, 3) contact points with a friction arrow
    arrow : (a, 3) direction and relative size of friction on the finger; the longest has length 1
    arrow_status : (a,) status of these contact points
    largest_shear : friction that the longest arrow stands for, MPa
    """

    body: Float
    contact: Float
    pressure: Float
    status: Int
    lines: Float
    features: Float
    rest: Float
    thing: Float
    arrow_at: Float
    arrow: Float
    arrow_status: Int
    largest_shear: float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def size(self) -> float:
        """Largest extent along an axis, mm."""
        return float(np.ptp(self.points, axis=0).max())

    @property
    def arrow_length(self) -> float:
        """Length of the longest arrow, mm; limited by the distance between arrows."""
        across = np.ptp(flat(self.arrow_at), axis=0) if len(self.arrow_at) else np.zeros(2)
        apart = max(np.sqrt(across.prod() / max(len(self.arrow_at), 1)), across.max() / max(len(self.arrow_at), 1))
        return min(_ARROW_LENGTH * self.size, _ARROW_SPACINGS * float(apart) or np.inf)

    @property
    def points(self) -> Float:
        """All points of the finger's surfaces and lines, shape (p, 3), mm."""
        parts = (self.body, self.contact, self.rest)
        return np.concatenate([part.reshape(-1, 3) for part in parts])


def skin_of(finger: DeformedFinger) -> Skin:
    """Return the skin of a deformed solid."""
    mesh, moved, shear, status = finger.mesh, finger.moved, finger.shear, finger.status
    touched = [FREE_FACES[k] for k in np.union1d(finger.faces, CONTACT) if len(mesh.facets.get(FREE_FACES[k], ()))]
    others = [f for label, f in mesh.facets.items() if label not in touched and len(f)]
    parts = []
    for label in touched:
        own = finger.faces == FREE_FACES.index(label)
        point = np.full(len(moved), -1)
        point[finger.nodes[own]] = np.flatnonzero(own)
        parts.append(_coloured(mesh.facets[label], moved, point, finger.pressure, status, finger.zones))
    contact, values, states = (np.concatenate([part[k] for part in parts]) for k in range(3))
    body = np.concatenate([_six_nodes(f, moved) for f in others]) if others else np.zeros((0, 6, 3))
    rims = [_rim(mesh.facets[label]) for label in touched]
    between = []
    for f in mesh.facets.values() if mesh.part is not None else ():
        part = part_of_facets(mesh, f)
        between += [_rim(f[part == number]) for number in np.unique(part)]
    chosen, arrow, largest = _arrows(moved[finger.nodes], shear, status)
    return Skin(
        body=body,
        contact=contact,
        pressure=values,
        status=states,
        lines=body[:, _SIDES].reshape(-1, 3, 3),
        features=np.concatenate([_edge_points(edges, moved) for edges in (*rims, *map(_rim, others), *between)]),
        rest=_edge_points(rims[0], mesh.points),
        thing=np.zeros((0, 3, 3)) if finger.thing is None else finger.thing,
        arrow_at=moved[finger.nodes[chosen]],
        arrow=arrow,
        arrow_status=status[chosen],
        largest_shear=largest,
    )


def _coloured(
    facets: Int, moved: Float, point: Int, pressure: Float, status: Int, zones: tuple[Zone, Zone] | None
) -> tuple[Float, Float, NDArray[np.int64]]:
    """Return the triangles (t, 3, 3) of a face, and pressure (t, 3) and status (t,) on them.

    `point` is the number (n,) of the contact point at each node, -1 where there is none.
    """
    at = point[facets[:, :3]]
    known, corner, statuses = at >= 0, np.zeros(at.shape), np.full(at.shape, OPEN)
    corner[known], statuses[known] = pressure[at[known]], status[at[known]]
    place = np.zeros((len(facets), len(_RING) + 1, 3))  # of the corners, of a point of each side, of their centre
    place[:, :3] = np.eye(3)
    of_point = np.zeros((len(status), 3))
    of_point[point[point >= 0]] = moved[point >= 0]
    shares = facet_borders(at, status, zones, of_point)
    for side, (i, j) in enumerate(FACET_SIDES):
        place[:, 3 + side, i], place[:, 3 + side, j] = 1.0 - shares[:, side], shares[:, side]
    place[:, 6] = place[:, 3:6].mean(axis=1)
    shapes = np.concatenate([place * (2.0 * place - 1.0), 4.0 * place * np.roll(place, -1, axis=2)], axis=2)
    return (
        (shapes @ _six_nodes(facets, moved))[:, _SIX].reshape(-1, 3, 3),
        np.einsum("fpc,fc->fp", place, corner)[:, _SIX].reshape(-1, 3),
        _status_on_six(statuses).ravel(),
    )


def _status_on_six(corner: Int) -> Int:
    """Return the status (m, 6) of the triangles of facets with the status (m, 3) of their corners."""
    # if all corners differ, each of the three inner triangles has that of the corner beside it
    inner = np.where((corner[:, [0]] == corner[:, [2]]), corner[:, [0]], corner[:, [1, 2, 0]])
    pairs = corner[:, 0] == corner[:, 1], corner[:, 1] == corner[:, 2]
    for equal, of in zip(pairs, (0, 1), strict=True):
        inner[equal] = corner[equal, of][:, None]
    return np.concatenate([corner, inner], axis=1)


def _six_nodes(facets: Int, points: Float) -> Float:
    """Return the nodes of facets, shape (m, 6, 3); linear facets get the middles of their edges."""
    corners = points[facets[:, :3]]
    if facets.shape[1] == TRI6.node_count:
        return points[facets]
    return np.concatenate([corners, 0.5 * (corners + np.roll(corners, -1, axis=1))], axis=1)


def _rim(facets: Int) -> Int:
    """Return the boundary of a surface: edges (k, 2 or 3) that belong to one of its facets only."""
    ends = facets[:, TRI3.edges].reshape(-1, 2)
    middles = facets[:, 3:].reshape(len(ends), -1)
    _, first, count = np.unique(np.sort(ends, axis=1), axis=0, return_index=True, return_counts=True)
    rim: Int = np.hstack([ends, middles])[first[count == 1]]
    return rim


def _edge_points(edges: Int, points: Float) -> Float:
    """Return end, middle and end of edges, shape (k, 3, 3)."""
    ends = points[edges[:, :2]]
    middle = points[edges[:, 2]] if edges.shape[1] == 3 else ends.mean(axis=1)
    return np.stack([ends[:, 0], middle, ends[:, 1]], axis=1)


def _arrows(points: Float, shear: Float, status: Int) -> tuple[Int, Float, float]:
    """Select evenly distributed friction arrows: the contact point nearest to the centre of each square of a grid.

    Returns
    -------
    chosen : (a,) indices of the contact points
    arrow : (a, 3) friction relative to the largest
    largest : largest friction, MPa
    """
    on = np.flatnonzero(status != OPEN)
    largest = float(np.linalg.norm(shear[on], axis=1).max(initial=0.0))
    if largest == 0.0:
        return on[:0], np.zeros((0, 3)), 0.0
    plane = flat(points[on])
    low, extent = plane.min(axis=0), np.ptp(plane, axis=0)
    step = max(float(np.sqrt(extent.prod() / _ARROW_COUNT)), 1e-9)
    square = np.floor((plane - low) / step)
    order = np.argsort(np.linalg.norm((plane - low) / step - square - 0.5, axis=1), kind="stable")
    _, first = np.unique(square[order], axis=0, return_index=True)
    chosen = on[order[first]]
    return chosen, shear[chosen] / largest, largest


# --- its picture --------------------------------------------------------------------------------------------------

Extent = tuple[float, float, float, float]
"""Left, right, lower and upper edge of a picture in the picture plane of `flat`, mm."""

Rendered: TypeAlias = tuple[list[Image], Extent]
"""Pictures (h, w, 3), cropped alike, and their extent."""


@contextmanager
def rendering_solid(skin: Skin, *colours: Float) -> Iterator[Callable[[], Rendered]]:
    """Render a solid once for each of some colours, beside what else is done within the block.

    Parameters
    ----------
    colours : (t, 3, 3) RGB colours at the corners of the contact triangles; the last picture has friction arrows

    Yields
    ------
    function that waits for the pictures, and returns them
    """
    seen = flat(skin.points)
    low, size = seen.min(axis=0), np.ptp(seen, axis=0)
    middle = np.append(low + 0.5 * size, skin.points.mean(axis=0) @ AXES[2]) @ AXES
    camera = Camera(AXES, middle, half_height(size), WINDOW)

    def rendered() -> Rendered:
        cropped, extent = framed(np.array(images()), (middle, size))
        return list(cropped), extent

    parts = [_parts(skin, own, arrows=own is colours[-1]) for own in colours]
    with rendering([Drawing(camera, own) for own in parts]) as images:
        yield rendered


def _parts(skin: Skin, colours: Float, arrows: bool) -> tuple[Polygons | Polylines | Arrows, ...]:
    """Return what the renderer draws of a solid; for the parameters see `rendering_solid`."""
    surfaces = (
        (skin.body[:, TRIANGLES].reshape(-1, 3, 3), BODY),
        (skin.contact, np.round(255.0 * colours.reshape(-1, 3)).astype(np.uint8)),
    )
    lines = (
        Polylines(skin.lines, LINE, 1.0, 0.5),
        Polylines(skin.features, FEATURE, 2.0),
        Polylines(skin.rest, REST, 1.5, 0.6),
    )
    parts: list[Polygons | Polylines | Arrows] = [Polygons(*unshared(at), colour) for at, colour in surfaces if len(at)]
    parts += [part for part in lines if part.points.size]
    before = 0.004 * skin.size * AXES[2]
    for state, colour in ARROWS.items() if arrows else ():
        on = skin.arrow_status == state
        if on.any():
            parts.append(Arrows(skin.arrow_at[on] + before, skin.arrow_length * skin.arrow[on], colour))
    if len(skin.thing):
        # before the surface that it touches, with which it would mix in spots
        parts.append(Polygons(*unshared(skin.thing + before), OBJECT_TINT, opacity=OBJECT_OPACITY))
    return tuple(parts)
