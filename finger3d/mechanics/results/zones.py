"""Extent of the zones of contact and stick along a line of contact points.

A zone ends between its last point and the next one.  Near the edge of contact the pressure p falls with the root of the
distance from it, so that p^2 is linear (Johnson 1985, sec. 4.2), and so does the distance of the friction from its
limit, mu p - |q|, at the border of stick (sec. 7.2).  The line through the values at the last two points of the zone
gives the end.  The traction of the last point reaches beyond the end, which makes that value large; the mean of the end
by extrapolation and of the middle between the two points errs by less (validation/error_bars.py).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.state import ContactState

ERROR_AT_ENDS = {"contact": 0.2, "stick": 0.3}
"""Error of the end of a zone over the distance of its last point to the next; twice it suffices in nine of ten cases of
validation/error_bars.py."""


def half_extents(x: Float, points: NDArray[np.intp], state: ContactState, area: Float) -> tuple[float, float]:
    """Return half the extents (mm) of contact and stick along a line.

    Parameters
    ----------
    x : (k,) mm, places along the line
    points : (k,) number of the contact point that each place has its state from
    area : (m,) mm2, tributary areas of the contact points
    """
    ends = zone_ends(x, points, state, area)
    contact, stick = (0.5 * (high - low) for low, high in ends)
    return contact, stick


def zone_ends(
    x: Float, points: NDArray[np.intp], state: ContactState, area: Float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return where contact and stick begin and end (mm) along a line; twice the same place for an empty zone."""
    order = np.argsort(x, kind="stable")
    places, numbers = x[order], points[order]
    status = state.status[numbers]
    pressure = state.force[numbers, 0] / area[numbers]
    shear = np.linalg.norm(state.force[numbers, 1:], axis=1) / area[numbers]
    return (
        _ends(places, status != OPEN, lambda beyond: pressure),
        _ends(places, status == STICK, lambda beyond: _to_limit(pressure, shear, status, beyond)),
    )


def _to_limit(pressure: Float, shear: Float, status: NDArray[np.int8], beyond: int) -> Float:
    """Return mu p - |q| (k,) MPa, with mu of the slipping point beyond the stick zone; p where that is open."""
    if status[beyond] != SLIP or pressure[beyond] <= 0.0:
        return pressure
    return np.asarray(shear[beyond] / pressure[beyond] * pressure - shear)


def _ends(x: Float, inside: NDArray[np.bool_], margin: Callable[[int], Float]) -> tuple[float, float]:
    """Return both ends of a zone of points of an ascending line.

    `margin` returns the quantity (k,) that vanishes at an end as the root of the distance, for the number of the point
    beyond that end.
    """
    zone = np.flatnonzero(inside)
    if not len(zone):
        return 0.0, 0.0
    low, high = (_end(x, inside, margin, int(zone[k]), step) for k, step in ((0, -1), (-1, 1)))
    return low, high


def _end(x: Float, inside: NDArray[np.bool_], margin: Callable[[int], Float], last: int, step: int) -> float:
    """Return the end of a zone beyond its last point, in the direction of `step`."""
    beyond, before = last + step, last - step
    if not 0 <= beyond < len(x):
        return float(x[last])
    middle = 0.5 * float(x[last] + x[beyond])
    if not (0 <= before < len(x) and inside[before]):
        return middle
    square = margin(beyond) ** 2
    fall = float(square[before] - square[last])
    if fall <= 0.0:
        return 0.5 * (middle + float(x[beyond]))
    reached = float(x[last] + (x[last] - x[before]) * square[last] / fall)
    low, high = sorted((float(x[last]), float(x[beyond])))
    return 0.5 * (middle + min(max(reached, low), high))
