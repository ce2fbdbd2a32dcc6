"""Openings of the lid, which covers the base of the cavity: the pour hole, which is a funnel, and the vents."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.mold.options import LID_MM, MoldOptions
from finger3d.mold.regions import disc, inside, nearest, widened
from finger3d.mold.solids import cone, cylinder

if TYPE_CHECKING:
    from build123d import Solid
    from manifold3d import CrossSection


_LEVEL = 5e-3  # over the length of a base: corners as far out as the outermost, of a rounded end too
_VENT_INSET = 0.6  # distance of a vent's middle from the edge of the base over its diameter
_LEAST_POUR_MM = 1.0


@dataclass(frozen=True)
class Ports:
    """Openings of the lid, mm; places are (x, z).

    Attributes
    ----------
    pour_mm, pour : diameter at the sensor and place of the pour hole
    funnel_mm : diameter of the pour hole outside
    vent_mm, vents : diameter and places of the vents
    """

    pour_mm: float
    pour: tuple[float, float]
    funnel_mm: float
    vent_mm: float
    vents: tuple[tuple[float, float], ...]

    @property
    def volume_mm3(self) -> float:
        """Volume of the pour hole and the vents in the lid."""
        a, b = self.pour_mm / 2.0, self.funnel_mm / 2.0
        return math.pi * LID_MM * ((a * a + a * b + b * b) / 3.0 + len(self.vents) * self.vent_mm**2 / 4.0)


def ports(base: CrossSection, options: MoldOptions) -> Ports:
    """Return the openings over a base, as large as it allows or as given.

    Parameters
    ----------
    base : region (x, z) of the base

    Raises
    ------
    Finger3dError
        If a hole does not open into the cavity whole, or the holes do not leave a rim between them.
    """
    x0, z0, x1, z1 = base.bounds()
    size = round(min(x1 - x0, z1 - z0), 2)  # the region is cut a little above the base
    pour = largest = min(6.0, 0.3 * size)
    while True:
        pour_mm = pour if options.pour_mm is None else options.pour_mm
        vent_mm = min(2.0, 0.1 * size, pour)
        vents = _vents(base, vent_mm)
        allowed = widened(base, -pour_mm / 2.0)
        for place in vents:
            allowed -= disc(place, vent_mm + pour_mm + 2.0 * options.rim_mm)
        if vents and not allowed.is_empty():
            break
        pour *= 0.95
        if pour < min(_LEAST_POUR_MM, largest):
            raise Finger3dError(
                f"--pour-mm {pour_mm:.3g}: does not fit on the base, {x1 - x0:.4g} x {z1 - z0:.4g} mm, with vents of "
                f"{vent_mm:.3g} mm and {options.rim_mm:g} mm between them; must be smaller"
            )
    middle = nearest(allowed, (0.0, 0.0))
    room = min(math.dist(middle, v) - vent_mm / 2.0 - options.rim_mm for v in vents)
    # The funnel may be wider than the base, but must not cover a vent.
    funnel = max(pour_mm, min(2.0 * pour_mm, 2.0 * room, size))
    return Ports(pour_mm, middle, funnel, vent_mm, vents)


def _vents(base: CrossSection, vent: float) -> tuple[tuple[float, float], ...]:
    """Return places at both ends of the base, and one on every other piece of it."""
    allowed = widened(base, -_VENT_INSET * vent)
    if allowed.is_empty():
        return ()
    x0, z0, x1, z1 = allowed.bounds()
    along = 0 if x1 - x0 >= z1 - z0 else 1
    places = []
    for piece in allowed.decompose():
        low, high = piece.bounds()[along], piece.bounds()[2 + along]
        for sign, end in ((-1.0, low), (1.0, high)):
            if abs(end - allowed.bounds()[along if sign < 0.0 else 2 + along]) < 1e-6:
                places.append(_extreme(piece, along, sign))
        if not any(inside(widened(piece, 1e-3), p) for p in places):
            places.append(_extreme(piece, along, 1.0 if high + low > 0.0 else -1.0))
    return tuple(sorted(places))


def _extreme(piece: CrossSection, along: int, sign: float) -> tuple[float, float]:
    """Return the middle of the outermost edge of a region."""
    corners = np.vstack(piece.to_polygons())
    outer = sign * corners[:, along]
    ends = corners[outer > outer.max() - _LEVEL * float(np.ptp(corners[:, along]))]
    middle = 0.5 * (ends.min(axis=0) + ends.max(axis=0))
    x, z = nearest(piece, middle)
    return round(x, 9), round(z, 9)


def openings(ports: Ports) -> list[Solid]:
    """Return the pour hole and the vents as solids through the lid."""
    x, z = ports.pour
    return [
        cone((x, -LID_MM, z), ports.funnel_mm, ports.pour_mm, LID_MM, "y"),
        *(cylinder((vx, -LID_MM, vz), ports.vent_mm, LID_MM, "y") for vx, vz in ports.vents),
    ]
