"""Openings of a mold: the pour hole and vents of the lid, and slots for the strips that carry foils of gauges."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.geometry.tessellate import triangulated
from finger3d.mechanics.readings import Gauge
from finger3d.mold.body import Body
from finger3d.mold.fasteners import Layout
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
    vents = [cylinder((vx, -LID_MM, vz), ports.vent_mm, LID_MM, "y") for vx, vz in ports.vents]
    return [cone((x, -LID_MM, z), ports.funnel_mm, ports.pour_mm, LID_MM, "y"), *vents]


LENGTH_MM, SECTION_MM = 5.0, (0.1, 3.0)
"""Length of a foil, and its thickness and width, where the scene does not give them."""

COVER_MM = 0.5
"""Least cover of silicone between a foil and the surface of the cavity."""

SLOT_GAP_MM = 0.15
"""Gap on either side of a strip in its slot."""

_TOLERANCE = 1e-6  # relative volume that booleans leave


@dataclass(frozen=True)
class FoilSlot:
    """Slot of the strip that carries the foils of one or several gauges through both walls, mm before shrinkage.

    Attributes
    ----------
    names, z_mm : names of the gauges on the strip, and z of the middles of their foils
    x_mm, y_mm : middle of the strip's section
    angle : radians, from x towards y
    length_mm, thickness_mm : section of the strip
    width_mm : of the foil, along z
    """

    names: tuple[str, ...]
    x_mm: float
    y_mm: float
    z_mm: tuple[float, ...]
    angle: float
    length_mm: float
    thickness_mm: float
    width_mm: float


def foils(gauges: Sequence[Gauge], section_mm: tuple[float, float] = SECTION_MM) -> tuple[FoilSlot, ...]:
    """Return the slots of a scene's gauges; gauges that differ in z only are on one strip.

    Parameters
    ----------
    section_mm : thickness and width of every foil
    """
    groups: dict[tuple[float, ...], list[Gauge]] = {}
    for g in gauges:
        key = (g.x_mm, g.y_mm, g.angle % np.pi, g.length_mm)
        groups.setdefault(tuple(round(v, 9) for v in key), []).append(g)

    def strip(on: list[Gauge]) -> FoilSlot:
        g, names, z = on[0], tuple(gauge.name for gauge in on), tuple(gauge.z_mm for gauge in on)
        return FoilSlot(names, g.x_mm, g.y_mm, z, g.angle, g.length_mm or LENGTH_MM, *section_mm)

    return tuple(strip(on) for on in groups.values())


def strip_solid(foil: FoilSlot, scale: float, gap: float, z_low: float, z_high: float) -> Solid:
    """Return a box along z at the place of a foil, with a gap on every side; its section is not scaled."""
    from build123d import Box, Pos, Rot

    at = Pos(foil.x_mm * scale, foil.y_mm * scale, 0.5 * (z_low + z_high)) * Rot(0, 0, float(np.degrees(foil.angle)))
    return at * Box(foil.length_mm + 2.0 * gap, foil.thickness_mm + 2.0 * gap, z_high - z_low)


def slot(foil: FoilSlot, layout: Layout, options: MoldOptions) -> Solid:
    """Return the strip with its gaps through both walls."""
    ends = float(layout.outer_low[2]), float(layout.outer_high[2])
    return strip_solid(foil, options.scale, SLOT_GAP_MM, *ends)


def check_foils(body: Body, foils: Sequence[FoilSlot], options: MoldOptions) -> None:
    """Raise a Finger3dError if two slots are too close, or a foil is not covered by silicone."""
    slots = [strip_solid(foil, options.scale, SLOT_GAP_MM, 0.0, 1.0) for foil in foils]
    for (i, a), (j, b) in itertools.combinations(enumerate(slots), 2):
        apart = float(a.distance_to(b))
        if apart < options.rim_mm:
            raise Finger3dError(
                f'gauge "{foils[j].names[0]}": its slot is {apart:.3g} mm from that of gauge "{foils[i].names[0]}", '
                f"must be {options.rim_mm:g} mm away or more; move one, or choose shorter foils"
            )
    for foil in foils:
        for z in foil.z_mm:
            ends = z * options.scale - foil.width_mm / 2.0, z * options.scale + foil.width_mm / 2.0
            room = strip_solid(foil, options.scale, COVER_MM, *ends)
            if body.shared(room) < (1.0 - _TOLERANCE) * room.volume:
                raise Finger3dError(
                    f'gauge "{foil.names[0]}": its foil, {foil.length_mm:g} x {foil.width_mm:g} x '
                    f"{foil.thickness_mm:g} mm, is not in the silicone with {COVER_MM:g} mm around it; move it "
                    "inwards, or choose a shorter foil"
                )


def strips(foils: Sequence[FoilSlot], layout: Layout, options: MoldOptions) -> Triangles | None:
    """Return the strips of all gauges, longer than the mold, for a picture; None without gauges."""
    if not foils:
        return None
    from build123d import Compound

    low, high = float(layout.outer_low[2]), float(layout.outer_high[2])
    out = 0.25 * (high - low)
    solids = Compound([strip_solid(foil, options.scale, 0.0, low - out, high + out) for foil in foils])
    points, faces, _ = triangulated(solids, list(solids.faces()), 1.0, 0.5)
    return Triangles(points, faces)
