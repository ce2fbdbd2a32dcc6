"""Structured triangulation of a half section: rows of points from the contact curve down, joined by triangles.

A section of one part is one band: the contact curve is lowered to the base, or, where the wall is too low for that, the
outline is shrunk towards the origin.  A layer under the contact curve is a band of its own.  A core lies in a band
between its upper side and the base, or, where the wall is low, is surrounded by one.

Rows run along the bands of the section. Their number and the points on them follow the size field, so triangles stay
well shaped while they grow. Parts of a section are bands, or ranges of a band, and no triangle crosses their border.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from finger3d._types import Float, Int
from finger3d.geometry.section import Arc, Core, Flat, Section
from finger3d.meshing.sizing import Grading

_LOW_WALL = 0.3  # below this share of the height, columns at the wall would be squashed
_STEEP = np.radians(60.0)  # a curve that ends steeper than this would be lowered along itself


@dataclass(frozen=True)
class Band:
    """A region between two curves over one parameter u.

    Attributes
    ----------
    points : function of u (n,) and a level
        Points (n, 2), mm: on the upper curve at level 1, on the lower curve at level 0, and between them.
    end : largest parameter; the contact curve ends at 1, the wall at 2
    parts : (from, to, part)
        Ranges of u and the numbers of the parts there; the ends of the ranges are nodes of every row.
    right : label of the boundary at the largest parameter
    shrinks : whether the lower curve is the origin
    corner : parameter of a corner of the lower curve, which is one of its nodes
    """

    points: Callable[[Float, float], Float]
    end: float
    parts: tuple[tuple[float, float, int], ...]
    right: str
    shrinks: bool = False
    corner: float | None = None

    def travel(self, u: Float) -> Float:
        """Return the distance (n,), mm, of the curves at parameters (n,)."""
        across = self.points(u, 1.0) - self.points(u, 0.0)
        return np.asarray(np.hypot(across[:, 0], across[:, 1]))

    @property
    def borders(self) -> list[float]:
        """Parameters of the borders between parts."""
        return [start for start, _, _ in self.parts[1:]]


@dataclass(frozen=True)
class Bands:
    """The bands of a section from its contact curve down.

    Attributes
    ----------
    bands : the first one begins at the contact curve
    walled : whether all rows end on the wall, and the last one lies on the base
    core : a core that the last band surrounds, to be filled with rows of its own, and the number of its part
    """

    bands: tuple[Band, ...]
    walled: bool
    core: tuple[Core, int] | None = None


def outline(section: Section, u: Float) -> Float:
    """Points (n, 2) of the outline: the contact curve for 0 <= u <= 1, the wall for 1 <= u <= 2."""
    points = section.contact.at(np.minimum(u, 1.0))
    wall = u > 1.0
    points[wall, 0] = section.half_length_mm
    points[wall, 1] = section.edge_height_mm * (2.0 - u[wall])
    return points


def bands(section: Section) -> Bands:
    """Divide a section into bands."""
    number = {label: i for i, label in enumerate(section.part_labels, start=1)}
    inner = section.inner
    below = _below(inner, number)
    if section.layer is None:
        return below
    right = "walls" if section.edge_height_mm > 0.0 else "base"
    parts = ((0.0, 1.0, number[section.layer.label]),)
    layer = Band(_between(section.contact.at, inner.contact.at), 1.0, parts, right)
    return Bands((layer, *below.bands), below.walled, below.core)


def _below(section: Section, number: dict[str, int]) -> Bands:
    """Divide a section without a layer."""
    wall = section.edge_height_mm
    core = section.core
    steep = getattr(section.contact, "angle", 0.0) > _STEEP
    foot = core.height_mm if core else 0.0
    if wall - foot >= _LOW_WALL * (section.height_mm - foot) and not steep:
        if core is None:
            lowered = Band(lambda u, s: outline(section, u) * [1.0, s], 1.0, ((0.0, 1.0, 0),), "walls")
            return Bands((lowered,), True)
        return _above_and_beside(section, core, number[core.label])
    end = 2.0 if wall > 0.0 else 1.0
    if core is None:
        shrunk = Band(lambda u, s: outline(section, u) * s, end, ((0.0, end, 0),), "base", shrinks=True)
        return Bands((shrunk,), False)
    corner = _diagonal(section, core)
    sides = _sides(core, corner, end)
    around = Band(_between(lambda u: outline(section, u), sides), end, ((0.0, end, 0),), "base", corner=corner)
    return Bands((around,), False, (core, number[core.label]))


def _between(upper: Callable[[Float], Float], lower: Callable[[Float], Float]) -> Callable[[Float, float], Float]:
    return lambda u, s: np.asarray(s * upper(u) + (1.0 - s) * lower(u))


def _above_and_beside(section: Section, core: Core, part: int) -> Bands:
    """Return a band above the line along the core's upper side, and one below it with the core and its surroundings."""
    length, width = section.half_length_mm, core.half_length_mm
    border = width / length

    def line(u: Float) -> Float:
        x = np.interp(u, [0.0, border, 1.0], [0.0, width, length])
        return np.stack([x, np.full_like(u, core.height_mm)], axis=1)

    beside = ((border, 1.0, 0),) if border < 1.0 else ()
    above = Band(_between(section.contact.at, line), 1.0, ((0.0, 1.0, 0),), "walls", corner=border if beside else None)
    below = Band(lambda u, s: line(u) * [1.0, s], 1.0, ((0.0, border, part), *beside), "walls")
    return Bands((above, below), True)


def _diagonal(section: Section, core: Core) -> float:
    """Return the parameter of the outline where the line at 45 degrees through the core's corner leaves the section."""
    x, y = core.half_length_mm, core.height_mm
    length = section.half_length_mm
    on_wall = y + length - x
    if on_wall <= section.edge_height_mm:
        return 2.0 - on_wall / section.edge_height_mm
    if isinstance(section.contact, Flat):
        return float(section.contact.fraction(np.array(x + section.contact.y_mm - y)))
    up = y - section.contact.centre_y_mm
    # (x + t)^2 + (up + t)^2 = R^2
    half = 0.5 * (x + up)
    t = -half + math.sqrt(half**2 - 0.5 * (x**2 + up**2 - section.contact.radius_mm**2))
    return min(float(section.contact.fraction(np.array(x + t))), 1.0 if section.edge_height_mm else 0.95)


def _sides(core: Core, corner: float, end: float) -> Callable[[Float], Float]:
    """Return the curve along the core's upper side, for u <= corner, and down its vertical side."""

    def curve(u: Float) -> Float:
        x = np.interp(u, [0.0, corner], [0.0, core.half_length_mm])
        return np.stack([x, np.interp(u, [corner, end], [core.height_mm, 0.0])], axis=1)

    return curve


def thin_places(section: Section) -> tuple[Float, Float]:
    """Return places (k, 3) where parts are thin, and the edge lengths (k,), mm, that cells there may have."""
    inner = section.inner
    places, sizes = [], []

    def add(points: Float, size: Float | float) -> None:
        places.append(points)
        sizes.append(np.broadcast_to(size, len(points)))

    if section.layer:
        thickness = section.height_mm - inner.height_mm
        add(_along(inner.contact.at, inner.contact.length_mm, thickness), 1.5 * thickness)
    if core := inner.core:
        x, y = core.half_length_mm, core.height_mm
        beside = inner.half_length_mm - core.half_length_mm
        upper = _along(lambda u: np.stack([x * u, np.full_like(u, y)], axis=1), x, y)
        gap = inner.contact.height(upper[:, 0]) - y
        add(upper, 2.0 * np.minimum(np.minimum(gap, y), x))
        for thickness in (x, beside):
            if thickness > 0.0:
                add(_along(lambda u: np.stack([np.full_like(u, x), y * u], axis=1), y, thickness), 2.0 * thickness)
    if not places:
        return np.zeros((0, 3)), np.zeros(0)
    points = np.vstack(places)
    return np.hstack([points, np.zeros((len(points), 1))]), np.concatenate(sizes)


def _along(curve: Callable[[Float], Float], length: float, step: float) -> Float:
    """Points (n, 2) on a curve, about a step (mm) apart."""
    return curve(np.linspace(0.0, 1.0, int(np.clip(math.ceil(length / step), 50, 2000)) + 1))


STRUCTURED_GROWTH = 0.25
"""Growth of the edge length per length away from the contact zone."""

_ASPECT = 3.0  # quadratic elements tolerate 5:1; joining rows with different numbers of points uses up the rest
_PLACES, _STATIONS = 80, 400  # along the outline and in depth, where prescribed edge lengths are looked up


@dataclass(frozen=True)
class Sizes:
    """Edge lengths (mm) in the contact zone `low` <= x <= `high`, and far from it.

    `grading` prescribes lengths inside the section, if there are any.
    """

    size_mm: float
    base_mm: float
    low: float
    high: float
    grading: Grading | None = None

    def steps(self, length: float, longest: Callable[[Float], Float] | None = None, start: float = 0.0) -> Float:
        """Depths (n + 1,), mm, of rows from 0 to `length` below a place that lies `start` below the zone.

        `longest` returns the largest distance of rows at depths; without it, it follows from the edge lengths alone.
        """
        grow = max(0.0, (self.base_mm - self.size_mm) / STRUCTURED_GROWTH)  # depth at which the base size is reached

        def count(depth: Float) -> Float:
            near = np.log1p(STRUCTURED_GROWTH * np.minimum(depth, grow) / self.size_mm) / STRUCTURED_GROWTH
            return near + np.maximum(depth - grow, 0.0) / self.base_mm

        sample = np.concatenate([np.linspace(0.0, length, 4001), np.geomspace(1e-6 * length, length, 2000)])
        sample = np.unique(sample)
        total = count(start + sample) - count(np.array(start))
        if longest is not None:
            density = np.maximum(np.gradient(total, sample), 1.0 / longest(sample))
            total = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(sample))])
        n = max(2, int(round(total[-1])))
        depth: Float = np.interp(np.linspace(0.0, total[-1], n + 1), total, sample)
        depth[-1] = length
        return depth

    def at(self, points: Float, section: Section) -> Float:
        """Edge length (n,) at points (n, 2): the contact size, growing with the distance from the zone."""
        x = np.clip(points[:, 0], self.low, self.high)
        reach = np.hypot(points[:, 0] - x, points[:, 1] - section.contact.height(x))
        size: Float = np.minimum(self.base_mm, self.size_mm + STRUCTURED_GROWTH * reach)
        return size if self.grading is None else np.minimum(size, self.grading.at(points, STRUCTURED_GROWTH))


@dataclass(frozen=True)
class Strip:
    """Two neighbouring rows of nodes, numbers and parameters of each, between which the cells belong to one part."""

    upper: Int
    lower: Int
    at_upper: Float
    at_lower: Float
    part: int


@dataclass(frozen=True)
class GridLayout:
    """Points on rows.

    Attributes
    ----------
    points : (n, 2) mm
    strips : pairs of rows
    facets : label -> (k, 2) edges of the boundary, outward
    curves : a curve, and its parameter (n,) at every point, nan away from it; for the contact curve and curved borders
    """

    points: Float
    strips: tuple[Strip, ...]
    facets: Mapping[str, Int]
    curves: tuple[tuple[Arc | Flat, Float], ...]

    def triangulated(self) -> tuple[Int, Int]:
        """Return the triangles (m, 3) between the rows, counter-clockwise, and the number (m,) of the part of each."""
        cells = [_zip(s.upper, s.lower, s.at_upper, s.at_lower) for s in self.strips]
        return np.vstack(cells), np.repeat([s.part for s in self.strips], [len(c) for c in cells])


def folded_zone(zone: tuple[float, float, float, float], half_length: float) -> tuple[float, float]:
    """Range of abs(x) that a zone covers, clipped to the section."""
    lo, hi = zone[0], zone[1]
    near = 0.0 if lo <= 0.0 <= hi else min(abs(lo), abs(hi))
    far = max(abs(lo), abs(hi))
    return min(near, half_length), min(far, half_length)


def _spread(u: Float, points: Float, size: Float, least: int) -> Float:
    """Return the parameters of points on a row sampled at `u`, one edge length of the size field apart."""
    step = np.hypot(*np.diff(points, axis=0).T)
    total = np.concatenate([[0.0], np.cumsum(step * 0.5 * (1.0 / size[1:] + 1.0 / size[:-1]))])
    n = max(least, int(round(total[-1])))
    params = np.interp(np.linspace(0.0, total[-1], n + 1), total, u)
    params[[0, -1]] = u[[0, -1]]
    return params


@dataclass(frozen=True)
class _Place:
    """A row in a band: its level, and the largest edge length (n,), mm, that its distance from other rows allows."""

    band: Band
    level: float
    longest: Float


@dataclass(frozen=True)
class GridRow:
    """Numbers and parameters of the nodes on a row, each (n,), and the points (n, 2), mm."""

    nodes: Int
    u: Float
    points: Float

    def part(self, low: float, high: float) -> tuple[Int, Float]:
        """Nodes and parameters from `low` to `high`."""
        inside = (low <= self.u) & (self.u <= high)
        return self.nodes[inside], self.u[inside]


def rows(section: Section, sizes: Sizes) -> GridLayout:
    """Lay out the rows and the points on them."""
    division = bands(section)
    sizes = _with_thin_places(section, sizes)
    u = _samples(section, sizes, division)
    places: list[list[_Place]] = []
    start = 0.0
    for band in division.bands:
        u_band = u[u <= band.end]
        length = _middle(section, sizes, division, band)
        longest = _longest(sizes, band, u_band, length) if sizes.grading else None
        depth = sizes.steps(length, longest, start)
        scales = 1.0 - depth / length
        scales[-1] = 0.0
        gaps = np.diff(depth)
        gap = np.minimum(np.append(gaps, gaps[-1]), np.insert(gaps, 0, gaps[0]))
        travel = band.travel(u_band)
        new = [[_Place(band, float(s), _ASPECT * g * travel / length)] for s, g in zip(scales, gap, strict=True)]
        if places:
            places[-1] += new.pop(0)
        places += new
        start += length
    laid = []
    count = 0
    for k, row_places in enumerate(places):
        params = _on_row(section, sizes, u, row_places, first=k == 0)
        points = row_places[-1].band.points(params, row_places[-1].level)
        laid.append(GridRow(count + np.arange(len(params)), params, points))
        count += len(params)
    return _joined(section, sizes, division, places, laid)


def _with_thin_places(section: Section, sizes: Sizes) -> Sizes:
    """Return the sizes with edge lengths that follow from the thickness of the parts."""
    points, wanted = thin_places(section)
    few = wanted < sizes.at(points[:, :2], section)
    return replace(sizes, grading=Grading(points[few], wanted[few])) if few.any() else sizes


def _samples(section: Section, sizes: Sizes, division: Bands) -> Float:
    """Return parameters at which curves are sampled, with those of corners and borders."""
    samples = int(np.clip(4.0 * section.contact.length_mm / sizes.size_mm, 400, 20_000))
    u = np.linspace(0.0, 1.0, samples + 1)
    if division.bands[-1].end > 1.0:
        u = np.concatenate([u, np.linspace(1.0, 2.0, samples // 4 + 2)[1:]])
    breaks = [b for band in division.bands for b in (*band.borders, band.corner) if b is not None]
    return np.union1d(u, breaks) if breaks else u


def _middle(section: Section, sizes: Sizes, division: Bands, band: Band) -> float:
    """Return the distance of a band's curves below the middle of the contact zone, mm."""
    x = 0.5 * (sizes.low + sizes.high) if sizes.low > 0.0 else 0.0
    if len(division.bands) == 1 and division.core is None:
        middle = section.contact.at(np.zeros(1))[0]
        if x > 0.0:
            middle = np.array([x, float(section.contact.height(np.array(x)))])
        return float(middle[1]) if division.walled else float(np.hypot(*middle))
    return float(band.travel(section.contact.fraction(np.array([x])))[0])


def _on_row(section: Section, sizes: Sizes, u: Float, row_places: list[_Place], first: bool) -> Float:
    """Return the parameters of the points on a row."""
    last = row_places[-1]
    band = last.band
    if last.level == 0.0 and band.shrinks:
        return np.zeros(1)
    u = u[u <= band.end]
    points = band.points(u, last.level)
    size = sizes.at(points, section)
    for place in row_places:
        reach = len(place.longest)
        size[:reach] = np.minimum(size[:reach], place.longest)
    breaks = sorted({b for place in row_places for b in place.band.borders})
    breaks += [place.band.corner for place in row_places if place.level == 0.0 and place.band.corner is not None]
    breaks = sorted(set(breaks))
    if not breaks and u[-1] > 1.0:
        corner = int(np.searchsorted(u, 1.0))
        below = _spread(u[corner:], points[corner:], size[corner:], 1 if first or len(row_places) > 1 else 0)
        if len(below) > 1:
            above = _spread(u[: corner + 1], points[: corner + 1], size[: corner + 1], 1)
            return np.concatenate([above, below[1:]])
    if not breaks:
        return _spread(u, points, size, 2 if first else 1)
    pieces = []
    for low, high in pairwise([0.0, *breaks, float(u[-1])]):
        inside = (low <= u) & (u <= high)
        pieces.append(_spread(u[inside], points[inside], size[inside], 1))
    return np.concatenate([pieces[0], *(p[1:] for p in pieces[1:])])


def _longest(sizes: Sizes, band: Band, u: Float, length: float) -> Callable[[Float], Float]:
    """Return a function of depths (n,) mm: the largest distance of rows (n,) mm that prescribed edge lengths allow."""
    grading = sizes.grading
    assert grading is not None
    places = u[np.linspace(0, len(u) - 1, _PLACES).astype(int)]
    travel = band.travel(places)
    stations = np.linspace(0.0, length, _STATIONS)
    points = np.vstack([band.points(places, level) for level in 1.0 - stations / length])
    size = grading.at(points, STRUCTURED_GROWTH).reshape(_STATIONS, _PLACES)
    least = (size * length / np.maximum(travel, 1e-3 * length)).min(axis=1)
    return lambda depth: np.interp(depth, stations, least)


def _joined(
    section: Section, sizes: Sizes, division: Bands, places: list[list[_Place]], laid: list[GridRow]
) -> GridLayout:
    """Return the strips between the rows, the boundary, and the curves."""
    strips: list[Strip] = []
    ends: dict[str, list[int]] = {}
    for row_places, upper, lower in zip(places, laid[:-1], laid[1:], strict=False):
        band = row_places[-1].band
        for low, high, part in band.parts:
            (a, ua), (b, ub) = upper.part(low, high), lower.part(low, high)
            strips.append(Strip(a, b, ua, ub, part))
        ends.setdefault(band.right, [int(strips[-1].upper[-1])]).append(int(strips[-1].lower[-1]))
    right = {label: np.array(nodes) for label, nodes in ends.items()}
    side = laid[-1]
    if division.core:
        core, part = division.core
        filling = _core_rows(section, sizes, core, side)
        strips += [Strip(a.nodes, b.nodes, a.u, b.u, part) for a, b in pairwise(filling)]
        laid = [*laid, *filling[1:]]
    points = np.full((int(max(row.nodes.max() for row in laid)) + 1, 2), np.nan)
    for row in laid:
        points[row.nodes] = row.points
    first = np.array([row.nodes[0] for row in laid])
    points[first, 0] = 0.0
    for label, nodes in right.items():
        axis, value = (0, section.half_length_mm) if label == "walls" else (1, 0.0)
        points[nodes, axis] = value
    bottom = laid[-1].nodes
    if division.walled or division.core:
        points[bottom, 1] = 0.0
    upward = {label: _edges(nodes)[:, ::-1] for label, nodes in right.items()}
    facets = {
        "contact": _edges(laid[0].part(0.0, 1.0)[0])[:, ::-1],
        "symmetry_x": _edges(first),
        "base": np.vstack([_edges(bottom), upward.get("base", _NO_EDGES)]),
        "walls": upward.get("walls", _NO_EDGES),
    }
    borders = [(section, laid[0])]
    if section.layer:
        borders.append((section.inner, laid[next(k for k, row_places in enumerate(places) if len(row_places) > 1)]))
    curves = []
    for owner, row in borders:
        beyond = row.part(1.0, 2.0)[0]
        facets["walls"] = np.vstack([facets["walls"], _edges(beyond)[:, ::-1]])
        nodes, u = row.part(0.0, 1.0)
        param = np.full(len(points), np.nan)
        param[nodes] = u
        curves.append((owner.contact, param))
    return GridLayout(points, tuple(strips), facets, tuple(curves))


_NO_EDGES = np.zeros((0, 2), dtype=np.int64)


def _edges(nodes: Int) -> Int:
    """Edges (n - 1, 2) of a chain of nodes (n,)."""
    return np.stack([nodes[:-1], nodes[1:]], axis=1)


def _core_rows(section: Section, sizes: Sizes, core: Core, around: GridRow) -> list[GridRow]:
    """Return the rows of a core, from the one on its upper side to the base, with the nodes on its vertical side."""
    x, y = around.points.T
    on_top, beside = y == core.height_mm, x == core.half_length_mm
    side, heights = around.nodes[beside], y[beside]
    core_rows = [GridRow(around.nodes[on_top], x[on_top] / core.half_length_mm, around.points[on_top])]
    count = int(around.nodes[-1]) + 1
    u = np.linspace(0.0, 1.0, _STATIONS + 1)
    for k in range(1, len(side)):
        gap = np.abs(np.diff(heights[max(0, k - 1) : k + 2])).min()
        points = np.stack([core.half_length_mm * u, np.full_like(u, heights[k])], axis=1)
        params = _spread(u, points, np.minimum(sizes.at(points, section), _ASPECT * gap), 1)
        nodes = np.append(count + np.arange(len(params) - 1), side[k])
        count += len(params) - 1
        points = np.stack([core.half_length_mm * params, np.full_like(params, heights[k])], axis=1)
        core_rows.append(GridRow(nodes, params, points))
    return core_rows


def _zip(upper: Int, lower: Int, at_upper: Float, at_lower: Float) -> Int:
    """Return the triangles between two rows of nodes, in the order of the middles of their edges."""
    mid_upper = 0.5 * (at_upper[1:] + at_upper[:-1])
    mid_lower = 0.5 * (at_lower[1:] + at_lower[:-1])
    below = np.searchsorted(mid_lower, mid_upper, side="left")
    above = np.searchsorted(mid_upper, mid_lower, side="right")
    down = np.stack([upper[:-1], lower[below], upper[1:]], axis=1)
    up = np.stack([lower[:-1], lower[1:], upper[above]], axis=1)
    return np.vstack([down, up])
