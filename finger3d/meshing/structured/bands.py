"""Bands of a half section: regions between an upper and a lower curve, in which a structured mesh lays its rows.

A section of one part is one band: the contact curve is lowered to the base, or, where the wall is too low for that, the
outline is shrunk towards the origin.  A layer under the contact curve is a band of its own.  A core lies in a band
between its upper side and the base, or, where the wall is low, is surrounded by one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.geometry.section import Core, Flat, Section

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
        return np.stack(
            [np.interp(u, [0.0, border, 1.0], [0.0, width, length]), np.full_like(u, core.height_mm)], axis=1
        )

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
