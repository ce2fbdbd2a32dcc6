"""Zones of contact and stick: where they end between the contact points, their extents along a line, their areas.

Near its edge the pressure of a contact is ``K sqrt(s)``, s the distance from the edge, and the gap beyond it is
``4 K s^(3/2) / (3 E*)`` (Johnson 1985, secs. 4.2 and 5.1).  The pressure p of the last point in contact and the gap g
of the next one, at a distance h, hence give the share t of the distance that is in contact ::

    (1 - t)^3 = rho t,   rho = (3 E* g / (4 p h))^2

At the border of stick the distance of the friction from its limit, mu p - |q|, falls with the root of the distance
(Johnson 1985, sec. 7.2), so that its square is linear.  How far it reaches follows from its slope among the points that
stick.  As the traction of the last point reaches beyond the border, the mean of this place and of the middle between
the points is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.state import ContactState

_EDGE_SHIFT = {2: 0.15, 3: 0.12}
"""Distance from the edge of contact that the formula gives to the true one, over that of the points.

Points see means over their hat functions. It is -0.15 +- 0.04 in 95 presses of random sections, -0.10 +- 0.05 in 40 of
random solids, and -0.17 under a ball (Hertz)."""

_STICK_SHIFT = 0.05
"""The same at the border of stick."""

_LARGE = 1e15
"""Bound of the root of rho, and of its inverse: beyond it the share is 0, or 1, to all digits."""

_SMALL_SLOPE = 1e-2
"""Singular values of a fit of a slope, over the largest, below which they are round-off: points on a line."""

_SHARES = 0.02, 0.98
"""Least and largest share of a side at which a border is drawn: no part of a facet is without area."""

_STEEP = 0.01
"""Square of the sine of the angle between a side and such a chord, below which the border is left where it is."""

FACET_SIDES = np.array([[0, 1], [1, 2], [2, 0]])
"""Corners at the ends of each side of a triangle."""

_ROUNDS = 2
"""Times that a drawn border is smoothed: two take off the teeth of unstructured meshes, and keep corners of zones."""


@dataclass(frozen=True)
class Zone:
    """Contact points in contact, or those that stick.

    Attributes
    ----------
    inside : (m,)
    share : function of points (k,) of the zone and of points (k,) beyond it
        Share (k,) of the way from the former to the latter that lies in the zone.
    """

    inside: NDArray[np.bool_]
    share: Callable[[Int, Int], Float]


def zones(state: ContactState, places: Float, area: Float, compliance: Float, edges: Int) -> tuple[Zone, Zone]:
    """Return the zones of contact and of stick.

    Parameters
    ----------
    places : (m, 3) mm, of the contact points at rest
    area : (m,) mm2, tributary areas
    compliance : (m,) 1/MPa, ``1 / E*``
    edges : (e, 2) pairs of neighbours
    """
    touches, sticks = state.status != OPEN, state.status == STICK
    pressure = np.where(touches, state.force[:, 0], 0.0) / area
    shift = _EDGE_SHIFT[state.force.shape[1]]

    def in_contact(last: Int, beyond: Int) -> Float:
        stress = 3.0 * np.maximum(state.gap[beyond], 0.0) / (4.0 * compliance[last])
        distance = np.linalg.norm(places[beyond] - places[last], axis=1)
        least = np.finfo(float).tiny
        root = np.minimum(stress / np.maximum(pressure[last] * distance, least), _LARGE)
        return np.minimum(_share_from_ratio(root**2) + shift, 1.0)

    shear = np.linalg.norm(state.force[:, 1:], axis=1) / area
    slips = state.status == SLIP
    normal = float(pressure[slips].sum())
    mu = float(shear[slips].sum()) / normal if normal > 0.0 else 0.0
    square = np.where(sticks, np.maximum(mu * pressure - shear, 0.0), 0.0) ** 2

    @cache
    def slopes() -> tuple[Int, Float, NDArray[np.bool_]]:
        points = np.flatnonzero(sticks)
        return np.cumsum(sticks) - 1, *_slopes(points, square, sticks, places, edges)

    def in_stick(last: Int, beyond: Int) -> Float:
        if not len(last):
            return np.zeros(0)
        number, slope, has_slope = slopes()
        fall = -np.einsum("kd,kd->k", slope[number[last]], places[beyond] - places[last])
        reached = np.where(square[last] < fall, square[last] / np.where(fall > 0.0, fall, 1.0), 1.0)
        reached = np.where(has_slope[number[last]], reached, 0.5)
        within = np.minimum(0.5 * (0.5 + reached) + _STICK_SHIFT, 1.0)
        return np.where(touches[beyond], within, in_contact(last, beyond))

    return Zone(touches, in_contact), Zone(sticks, in_stick)


def _share_from_ratio(rho: Float) -> Float:
    """Return the root t (k,) of ``(1 - t)^3 = rho t`` in 0..1."""
    some = np.maximum(rho, _LARGE**-2)
    return np.asarray(1.0 - 2.0 * np.sqrt(some / 3.0) * np.sinh(np.arcsinh(1.5 * np.sqrt(3.0 / some)) / 3.0))


def _slopes(
    points: Int, values: Float, inside: NDArray[np.bool_], places: Float, edges: Int
) -> tuple[Float, NDArray[np.bool_]]:
    """Return slopes (k, 3) at points (k,), by least squares over neighbours in a zone, and which points have any."""
    number = np.full(len(places), -1)
    number[points] = np.arange(len(points))
    pairs = np.vstack([edges, edges[:, ::-1]])
    pairs = pairs[(number[pairs[:, 0]] >= 0) & inside[pairs[:, 1]]]
    at, rows = number[pairs[:, 0]], places[pairs[:, 1]] - places[pairs[:, 0]]
    weight = 1.0 / np.maximum(np.einsum("ed,ed->e", rows, rows), 1e-300)
    matrix, right = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    np.add.at(matrix, at, np.einsum("e,ei,ej->eij", weight, rows, rows))
    np.add.at(right, at, (weight * (values[pairs[:, 1]] - values[pairs[:, 0]]))[:, None] * rows)
    slope = np.einsum("kij,kj->ki", np.linalg.pinv(matrix, rcond=_SMALL_SLOPE, hermitian=True), right)
    return slope, np.bincount(at, minlength=len(points)) > 0


def edges_of(facets: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the pairs of points (e, 2) that an edge of facets (f, d) joins."""
    corners = range(facets.shape[1])
    pairs = np.vstack([facets[:, [i, j]] for i in corners for j in range(i)])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def zone_ends(x: Float, points: Int, zone: Zone) -> tuple[float, float]:
    """Return where a zone begins and ends (mm) along a line; twice the same place for an empty zone.

    Parameters
    ----------
    x : (k,) mm, places along the line
    points : (k,) number of the contact point that each place has its state from
    """
    order = np.argsort(x, kind="stable")
    at, numbers = x[order], points[order]
    among = np.flatnonzero(zone.inside[numbers])
    if not len(among):
        return 0.0, 0.0
    low, high = (_end(at, numbers, zone, int(among[k]), step) for k, step in ((0, -1), (-1, 1)))
    return low, high


def _end(x: Float, points: Int, zone: Zone, last: int, step: int) -> float:
    """Return the end of a zone beyond its last place on an ascending line, in the direction of `step`."""
    beyond = last + step
    if not 0 <= beyond < len(x):
        return float(x[last])
    share = float(zone.share(points[[last]], points[[beyond]])[0])
    return float(x[last] + share * (x[beyond] - x[last]))


def zone_area(facets: Int, area: Float, zone: Zone) -> float:
    """Return the area (mm2) of a zone: of its facets, and of the part of those that its border cuts.

    Parameters
    ----------
    facets : (f, d) numbers of the contact points at their vertices
    area : (f,) mm2
    """
    inside = zone.inside[facets]
    count = inside.sum(axis=1)
    total = float(area[count == facets.shape[1]].sum())
    for alone in (True, False):  # the vertex that is in the zone, or outside of it, alone
        cut = (count == 1) if alone else (count == 2) & (facets.shape[1] == 3)
        ring, which = facets[cut], np.argmax(inside[cut] == alone, axis=1)
        one = ring[np.arange(len(ring)), which]
        part = np.ones(len(ring))
        for k in range(1, facets.shape[1]):
            other = ring[np.arange(len(ring)), (which + k) % facets.shape[1]]
            part *= zone.share(one, other) if alone else 1.0 - zone.share(other, one)
        total += float(area[cut] @ (part if alone else 1.0 - part))
    return total


def border_shares(pairs: Int, status: Int, zones: tuple[Zone, Zone] | None) -> Float:
    """Return where the status changes on the way from one contact point to another, (k,) shares of it.

    Parameters
    ----------
    pairs : (k, 2) contact points; -1: none, an open place whose gap is not known
    zones : of contact and of stick; None: midway
    """
    shares = np.full(len(pairs), 0.5)
    if zones is None:
        return shares
    state = np.where(pairs >= 0, status[pairs], OPEN)
    known = (pairs >= 0).all(axis=1) & (state[:, 0] != state[:, 1])
    contact, stick = zones
    for zone in (contact, stick):  # a border of stick counts, where it is that of contact, too
        for inner, outer in ((0, 1), (1, 0)):
            on = np.flatnonzero(known)
            on = on[zone.inside[pairs[on, inner]] & ~zone.inside[pairs[on, outer]]]
            share = np.clip(zone.share(pairs[on, inner], pairs[on, outer]), *_SHARES)
            shares[on] = share if inner == 0 else 1.0 - share
    return shares


def facet_borders(facets: Int, status: Int, zones: tuple[Zone, Zone] | None, places: Float) -> Float:
    """Return where the status changes on each side of the facets of a surface, (f, 3) shares, for drawing.

    The border on a side is moved, by half of the way, to the chord between its neighbours, the borders on the two sides
    that it is joined to across the facets beside it.

    Parameters
    ----------
    facets : (f, 3) contact points at the corners; -1: none
    zones : of contact and of stick; None: midway
    places : (m, 3) mm, of the contact points
    """
    ends = facets[:, FACET_SIDES].reshape(-1, 2)
    shares = border_shares(ends, status, zones)
    if zones is None:
        return shares.reshape(-1, 3)
    sides, number = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    turned = ends[:, 0] > ends[:, 1]
    at = np.zeros(len(sides))
    at[number] = np.where(turned, 1.0 - shares, shares)
    whole, state = np.asarray((facets >= 0).all(axis=1)), status[facets]
    cut = np.logical_and(whole[:, None], np.not_equal(state, np.roll(state, -1, axis=1)))
    on_two = cut.sum(axis=1) == 2
    pairs = number.reshape(-1, 3)[on_two][cut[on_two]].reshape(-1, 2)
    one, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    between = np.bincount(one, minlength=len(sides)) == 2
    order = np.argsort(one, kind="stable")
    before, after = other[order][between[one[order]]].reshape(-1, 2).T
    start, along = places[sides[:, 0]], places[sides[:, 1]] - places[sides[:, 0]]
    for _ in range(_ROUNDS):
        border = start + at[:, None] * along
        chord = border[after] - border[before]
        chord /= np.maximum(np.linalg.norm(chord, axis=1), np.finfo(float).tiny)[:, None]
        arms = np.stack([along[between], border[before] - start[between]])
        across, reach = arms - np.einsum("ask,sk->as", arms, chord)[..., None] * chord
        square, long = (np.einsum("sk,sk->s", v, v) for v in (across, along[between]))
        met = np.einsum("sk,sk->s", across, reach) / np.where(square > _STEEP * long, square, np.inf)
        met = np.where(square > _STEEP * long, met, at[between])
        at[between] = np.clip(0.5 * (at[between] + met), *_SHARES)
    return np.where(turned, 1.0 - at[number], at[number]).reshape(-1, 3)
