"""Structured triangulation of a half section: rows of points from the contact curve down, zipped into triangles.

Rows are the contact curve lowered towards the base, or, where the wall is too low for that, the outline shrunk towards
the origin. Their number and the points on them follow the size field, so triangles stay well shaped while they grow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float, Int
from finger3d.geometry.section import Section
from finger3d.meshing.grading import Grading

RATE = 0.25
"""Growth of the edge length per length away from the contact zone."""

_ASPECT = 3.0  # quadratic elements bear 5:1; zipping rows of different counts costs the rest
_LOW_WALL = 0.3  # below this share of the height, columns at the wall would be squashed
_PLACES, _STATIONS = 80, 400  # along the outline and in depth, where prescribed edge lengths are looked up
_STEEP = np.radians(60.0)  # a curve that ends steeper than this would be lowered along itself


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

    def steps(self, length: float, longest: Callable[[Float], Float] | None = None) -> Float:
        """Depths (n + 1,), mm, of rows from 0 to `length` below the zone.

        `longest` returns the largest distance of rows at depths; without it, it follows from the edge lengths alone.
        """
        grow = max(0.0, (self.base_mm - self.size_mm) / RATE)  # depth at which the base size is reached

        def count(depth: Float) -> Float:
            near = np.log1p(RATE * np.minimum(depth, grow) / self.size_mm) / RATE
            return near + np.maximum(depth - grow, 0.0) / self.base_mm

        sample = np.concatenate([np.linspace(0.0, length, 4001), np.geomspace(1e-6 * length, length, 2000)])
        sample = np.unique(sample)
        total = count(sample)
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
        size: Float = np.minimum(self.base_mm, self.size_mm + RATE * reach)
        return size if self.grading is None else np.minimum(size, self.grading.at(points, RATE))


@dataclass(frozen=True)
class Rows:
    """Points on rows: row k has the parameters `params[k]` on the outline, and is scaled by `scales[k]`."""

    scales: Float
    params: list[Float]
    columns: bool

    @property
    def count(self) -> int:
        """Number of points."""
        return sum(len(p) for p in self.params)


@dataclass(frozen=True)
class Grid:
    """Linear triangles of a half section.

    Attributes
    ----------
    points : (n, 2) mm
    cells : (m, 3) counter-clockwise
    facets : label -> (k, 2) edges, outward
    arc : (n,) parameter on the contact curve, nan away from it
    """

    points: Float
    cells: Int
    facets: Mapping[str, Int]
    arc: Float


def folded_zone(zone: tuple[float, float, float, float], half_length: float) -> tuple[float, float]:
    """Range of abs(x) that a zone covers, clipped to the section."""
    lo, hi = zone[0], zone[1]
    near = 0.0 if lo <= 0.0 <= hi else min(abs(lo), abs(hi))
    far = max(abs(lo), abs(hi))
    return min(near, half_length), min(far, half_length)


def _outline(section: Section, u: Float) -> Float:
    """Points (n, 2) of the outline: the contact curve for 0 <= u <= 1, the wall for 1 <= u <= 2."""
    points = section.contact.at(np.minimum(u, 1.0))
    wall = u > 1.0
    points[wall, 0] = section.half_length_mm
    points[wall, 1] = section.edge_height_mm * (2.0 - u[wall])
    return points


def _spread(u: Float, points: Float, size: Float, least: int) -> Float:
    """Return the parameters of points on a row sampled at `u`, one edge length of the size field apart."""
    step = np.hypot(*np.diff(points, axis=0).T)
    total = np.concatenate([[0.0], np.cumsum(step * 0.5 * (1.0 / size[1:] + 1.0 / size[:-1]))])
    n = max(least, int(round(total[-1])))
    params = np.interp(np.linspace(0.0, total[-1], n + 1), total, u)
    params[[0, -1]] = u[[0, -1]]
    return params


def rows(section: Section, sizes: Sizes) -> Rows:
    """Lay out the rows and the points on them."""
    wall = section.edge_height_mm
    steep = getattr(section.contact, "angle", 0.0) > _STEEP
    columns = wall >= _LOW_WALL * section.height_mm and not steep
    samples = int(np.clip(4.0 * section.contact.length_mm / sizes.size_mm, 400, 20_000))
    u = np.linspace(0.0, 1.0, samples + 1)
    if not columns and wall > 0.0:
        u = np.concatenate([u, np.linspace(1.0, 2.0, samples // 4 + 2)[1:]])
    outline = _outline(section, u)
    middle = section.contact.at(np.zeros(1))[0]
    if sizes.low > 0.0:
        x = 0.5 * (sizes.low + sizes.high)
        middle = np.array([x, float(section.contact.height(np.array(x)))])
    travel = outline[:, 1] if columns else np.hypot(outline[:, 0], outline[:, 1])
    length = middle[1] if columns else float(np.hypot(*middle))
    depth = sizes.steps(length, _longest(sizes, outline, columns, length) if sizes.grading else None)
    scales = 1.0 - depth / length
    scales[-1] = 0.0
    gaps = np.diff(depth)
    gap = np.minimum(np.append(gaps, gaps[-1]), np.insert(gaps, 0, gaps[0]))
    params = []
    for k, s in enumerate(scales):
        if s == 0.0 and not columns:
            params.append(np.zeros(1))
            continue
        points = outline * [1.0, s] if columns else outline * s
        size = np.minimum(sizes.at(points, section), _ASPECT * gap[k] * travel / length)
        corner = samples
        if u[-1] > 1.0:
            below = _spread(u[corner:], points[corner:], size[corner:], 1 if k == 0 else 0)
            if len(below) > 1:
                above = _spread(u[: corner + 1], points[: corner + 1], size[: corner + 1], 1)
                params.append(np.concatenate([above, below[1:]]))
                continue
        params.append(_spread(u, points, size, 2 if k == 0 else 1))
    return Rows(scales, params, columns)


def _longest(sizes: Sizes, outline: Float, columns: bool, length: float) -> Callable[[Float], Float]:
    """Return a function of depths (n,) mm: the largest distance of rows (n,) mm that prescribed edge lengths allow."""
    grading = sizes.grading
    assert grading is not None
    places = outline[np.linspace(0, len(outline) - 1, _PLACES).astype(int)]
    travel = places[:, 1] if columns else np.hypot(places[:, 0], places[:, 1])
    stations = np.linspace(0.0, length, _STATIONS)
    shares = 1.0 - stations / length
    at = places * np.stack([np.ones_like(shares) if columns else shares, shares], axis=1)[:, None]
    size = grading.at(at.reshape(-1, 2), RATE).reshape(_STATIONS, _PLACES)
    least = (size * length / np.maximum(travel, 1e-3 * length)).min(axis=1)
    return lambda depth: np.interp(depth, stations, least)


def _zip(upper: Int, lower: Int, at_upper: Float, at_lower: Float) -> Int:
    """Return the triangles between two rows of nodes, in the order of the middles of their edges."""
    mid_upper = 0.5 * (at_upper[1:] + at_upper[:-1])
    mid_lower = 0.5 * (at_lower[1:] + at_lower[:-1])
    below = np.searchsorted(mid_lower, mid_upper, side="left")
    above = np.searchsorted(mid_upper, mid_lower, side="right")
    down = np.stack([upper[:-1], lower[below], upper[1:]], axis=1)
    up = np.stack([lower[:-1], lower[1:], upper[above]], axis=1)
    return np.vstack([down, up])


def triangulate(section: Section, layout: Rows) -> Grid:
    """Turn rows into triangles with labelled edges."""
    offset = np.concatenate([[0], np.cumsum([len(p) for p in layout.params])])
    numbers = [np.arange(a, b) for a, b in zip(offset[:-1], offset[1:], strict=True)]
    points = []
    for s, u in zip(layout.scales, layout.params, strict=True):
        row = _outline(section, u)
        points.append(row * [1.0, s] if layout.columns else row * s)
    pairs = list(zip(numbers[:-1], numbers[1:], layout.params[:-1], layout.params[1:], strict=True))
    cells = np.vstack([_zip(a, b, ua, ub) for a, b, ua, ub in pairs])
    first, last = np.array([n[0] for n in numbers]), np.array([n[-1] for n in numbers])
    left = np.stack([first[:-1], first[1:]], axis=1)
    right = np.stack([last[1:], last[:-1]], axis=1)
    top = np.stack([numbers[0][1:], numbers[0][:-1]], axis=1)
    on_wall = layout.params[0][1:] > 1.0
    facets = {"contact": top[~on_wall], "symmetry_x": left}
    if layout.columns:
        facets["base"] = np.stack([numbers[-1][:-1], numbers[-1][1:]], axis=1)
        facets["walls"] = right
    else:
        facets["base"] = right
        facets["walls"] = top[on_wall]
    arc = np.full(offset[-1], np.nan)
    arc[: offset[1]] = np.where(layout.params[0] <= 1.0, layout.params[0], np.nan)
    xy = np.vstack(points)
    xy[first, 0] = 0.0
    if layout.columns:
        xy[last, 0] = section.half_length_mm
        xy[numbers[-1], 1] = 0.0
    else:
        xy[last, 1] = 0.0
    return Grid(xy, cells, facets, arc)
