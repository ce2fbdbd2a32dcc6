"""What covers the base of the cavities: a lid with the pour hole, the vents and the riser, or a carrier.

The riser is a cup on the pour hole. Bubbles that rise from the silicone leave a void, which silicone from the riser
fills. Where there is no air left to rise, the level of the riser shows that the cavity is full.

The carrier is a printed plate in place of the lid, whose holes silicone fills and grips. The holes are narrow at the
sensor and wider outside, so that the silicone that fills them cannot be pulled out. They are open outside: air leaves
through them, and silicone stands in them. The carrier stays on the finger and becomes its base: the solid with the
label ``carrier`` beside the silicone, see :func:`finger_on_carrier`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.mold.options import MoldOptions
from finger3d.mold.regions import disc, footprint, inside, nearest, widened
from finger3d.mold.solids import cone, cylinder, one, revolved

if TYPE_CHECKING:
    from build123d import Solid
    from manifold3d import CrossSection

    from finger3d.geometry.surface import Triangles


_BASE_HEIGHT = 1e-4  # over the body's height: where its base is cut
_LEVEL = 5e-3  # over the length of a base: corners as far out as the outermost, of a rounded end too
_VENT_INSET = 0.6  # distance of a vent's middle from the edge of the base over its diameter
_LEAST_POUR_MM = 1.0
_LEAST_CUP_MM = 2.0  # least height of the cylinder above a riser's cone
_SPIGOT = 0.5  # length of the riser's spigot, over the thickness of the lid


@dataclass(frozen=True)
class Riser:
    """The riser's cup.

    Attributes
    ----------
    radius_mm : inside
    height_mm : above the lid
    spigot_mm : length of the spigot that holds it in the lid
    wall_mm : of the cup and of the spigot
    volume_mm3 : of the cup, its spigot and the pour hole below
    """

    radius_mm: float
    height_mm: float
    spigot_mm: float
    wall_mm: float
    volume_mm3: float


@dataclass(frozen=True)
class Ports:
    """Openings of the lid over one cavity, mm; places are (x, z).

    Attributes
    ----------
    pour_mm, pour : diameter at the sensor and place of the pour hole
    funnel_mm : diameter of the pour hole outside, without a riser
    vent_mm, vents : diameter and places of the vents
    riser : None without one
    """

    pour_mm: float
    pour: tuple[float, float]
    funnel_mm: float
    vent_mm: float
    vents: tuple[tuple[float, float], ...]
    riser: Riser | None

    @property
    def outside_mm(self) -> float:
        """Diameter of the pour hole at the outer face of the lid, or below the riser."""
        return self.funnel_mm if self.riser is None else self.pour_mm

    def volume_mm3(self, cover_mm: float) -> float:
        """Return the volume of the pour hole, the riser and the vents in a lid of this thickness."""
        vents = len(self.vents) * math.pi * self.vent_mm**2 / 4.0 * cover_mm
        if self.riser is not None:
            return self.riser.volume_mm3 + vents
        a, b = self.pour_mm / 2.0, self.funnel_mm / 2.0
        return math.pi * cover_mm / 3.0 * (a * a + a * b + b * b) + vents


def base_region(surface: Triangles) -> CrossSection:
    """Return the region (x, z) of a body's base."""
    return footprint(surface, _BASE_HEIGHT)


def ports(
    base: CrossSection,
    cavity_mm3: float,
    options: MoldOptions,
    vented: bool = True,
) -> Ports:
    """Return the openings over a base, as large as it allows or as given.

    Parameters
    ----------
    base : region (x, z) of the base
    cavity_mm3 : volume of the cavity, of which the riser holds a share
    vented : whether the lid has vents; the holes of a carrier serve as such

    Raises
    ------
    Finger3dError
        If a hole does not open into the cavity whole, or the holes do not leave a rim between them.
    """
    x0, z0, x1, z1 = base.bounds()
    size = round(min(x1 - x0, z1 - z0), 2)  # the region is cut a little above the base
    vent = min(2.0, 0.1 * size) if options.vent_mm is None else options.vent_mm
    pour = min(6.0, 0.3 * size) if options.pour_mm is None else options.pour_mm
    vents = _vents(base, vent) if vented else ()
    allowed = _allowed(base, vents, vent, pour, options)
    while options.pour_mm is None and allowed.is_empty() and pour > _LEAST_POUR_MM:
        pour *= 0.95
        allowed = _allowed(base, vents, vent, pour, options)
    if allowed.is_empty() or (vented and not vents):
        raise Finger3dError(
            f"--pour-mm {pour:.3g} --vent-mm {vent:.3g}: do not fit on the base, {x1 - x0:.4g} x {z1 - z0:.4g} mm, "
            f"with {options.rim_mm:g} mm between them; must be smaller"
        )
    middle = nearest(allowed, (0.0, 0.0))
    room = min(
        [math.dist(middle, v) - vent / 2.0 - options.rim_mm for v in vents] + [0.5 * (x1 - x0), 0.5 * size + 4.0]
    )
    # The funnel and the cup stand outside: they may be wider than the base, but must not cover a vent.
    funnel = max(pour, min(2.0 * pour, 2.0 * room, size))
    riser = _riser(pour, cavity_mm3, room, options) if options.riser else None
    return Ports(pour, middle, funnel, vent, vents, riser)


def _allowed(
    base: CrossSection, vents: tuple[tuple[float, float], ...], vent: float, pour: float, options: MoldOptions
) -> CrossSection:
    """Return where the middle of the pour hole may lie: its socket leaves a rim beside each vent."""
    socket = pour + (2.0 * (options.rim_mm + options.gap_mm) if options.riser else 0.0)
    allowed = widened(base, -pour / 2.0)
    for place in vents:
        allowed -= disc(place, vent + socket + 2.0 * options.rim_mm)
    return allowed


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
        if not any(inside(widened(piece, 1e-3), np.array([p]))[0] for p in places):
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


def _riser(pour: float, cavity_mm3: float, room: float, options: MoldOptions) -> Riser:
    """Return the cup: as high as its radius above the cone, narrower between vents, and never wider than its place."""
    cover, wall, a = options.cover_mm, options.rim_mm, pour / 2.0
    wanted = options.riser * cavity_mm3 - math.pi * a**2 * cover
    radius = ((max(wanted, 0.0) + math.pi * a**3 / 3.0) / (4.0 * math.pi / 3.0)) ** (1.0 / 3.0)
    radius = max(a, min(radius, room - wall))
    slope = radius - a  # of 45 degrees, which prints without support
    held = math.pi / 3.0 * (radius**3 - a**3)
    above = max(_LEAST_CUP_MM, (wanted - held) / (math.pi * radius**2))
    total = math.pi * a**2 * cover + held + math.pi * radius**2 * above
    return Riser(radius, slope + above, _SPIGOT * cover, wall, total)


def openings(ports: Ports, x: float, options: MoldOptions) -> list[Solid]:
    """Return the pour hole and the vents of the cavity at `x` as solids through the lid."""
    cover = options.cover_mm
    px, pz = ports.pour[0] + x, ports.pour[1]
    cut = [cylinder((vx + x, -cover, vz), ports.vent_mm, cover, "y") for vx, vz in ports.vents]
    if ports.riser is None:
        return [cone((px, -cover, pz), ports.funnel_mm, ports.pour_mm, cover, "y"), *cut]
    socket = ports.pour_mm + 2.0 * ports.riser.wall_mm + 2.0 * options.gap_mm
    return [
        cylinder((px, -cover, pz), ports.pour_mm, cover, "y"),
        cylinder((px, -cover, pz), socket, ports.riser.spigot_mm, "y"),
        *cut,
    ]


def riser_cup(ports: Ports, x: float, options: MoldOptions) -> Solid:
    """Return the cup of the cavity at `x`, its spigot in the lid."""
    r = ports.riser
    assert r is not None
    a, outer, spigot = ports.pour_mm / 2.0, r.radius_mm + r.wall_mm, ports.pour_mm / 2.0 + r.wall_mm
    # The collar rests on the lid; a tube without collar rests on the bottom of its socket.
    length = r.spigot_mm - (options.gap_mm if outer > spigot + 1e-6 else 0.0)
    profile = [(a, -length), (spigot, -length), (spigot, 0.0), (outer, 0.0), (outer, r.height_mm),
               (r.radius_mm, r.height_mm), (r.radius_mm, r.radius_mm - a), (a, 0.0)]  # fmt: skip
    profile = [p for i, p in enumerate(profile) if math.dist(p, profile[i - 1]) > 1e-6]
    return revolved(profile, (ports.pour[0] + x, -options.cover_mm, ports.pour[1]), "-y")


LABEL = "carrier"
"""Label of the carrier among the solids of a finger."""

HEAD = 1.7
"""Diameter of a hole outside over that at the sensor."""

_PITCH = 3.0  # least distance of two holes' middles over the diameter at the sensor
_LEAST_HOLES = 2
_INSIDE_MM = 0.05  # by which the outermost holes lie inside, more than outlines of regions are off


@dataclass(frozen=True)
class Keys:
    """Keyed holes of the carrier under one cavity.

    Attributes
    ----------
    places : (x, z) of the middles, mm
    neck_mm, head_mm : diameters at the sensor and outside
    """

    places: tuple[tuple[float, float], ...]
    neck_mm: float
    head_mm: float

    def volume_mm3(self, cover_mm: float) -> float:
        """Return the volume of the holes in a carrier of this thickness."""
        a, b = self.neck_mm / 2.0, self.head_mm / 2.0
        straight, slope = _heights(self, cover_mm)
        each = math.pi * (
            a * a * straight + slope / 3.0 * (a * a + a * b + b * b) + b * b * (cover_mm - straight - slope)
        )
        return len(self.places) * each


def _heights(keys: Keys, cover_mm: float) -> tuple[float, float]:
    """Return the heights of the neck and of the cone, which widens by 45 degrees where there is room."""
    slope = min(0.5 * (keys.head_mm - keys.neck_mm), 0.5 * cover_mm)
    return 0.4 * (cover_mm - slope), slope


def keys(base: CrossSection, ports: Ports, options: MoldOptions) -> Keys:
    """Return holes on a grid over the base, clear of its edge and of the pour hole.

    Raises
    ------
    Finger3dError
        If fewer than two holes fit on the base.
    """
    neck, head, rim = options.key_mm, HEAD * options.key_mm, options.rim_mm
    pitch = max(_PITCH * neck, head + 2.0 * rim)
    pour = ports.pour_mm + 2.0 * (ports.riser.wall_mm + options.gap_mm if ports.riser else 0.0)
    outside = max(pour, ports.funnel_mm if ports.riser is None else 2.0 * (ports.riser.radius_mm + rim))
    allowed = widened(base, -(neck / 2.0 + rim)) - disc(ports.pour, outside + head + 2.0 * rim)
    x0, z0, x1, z1 = base.bounds()
    ticks = [_ticks(low, high, pitch, neck + 2.0 * rim + 2.0 * _INSIDE_MM) for low, high in ((x0, x1), (z0, z1))]
    grid = np.array([(x, z) for x in ticks[0] for z in ticks[1]])
    places = grid[inside(allowed, grid)] if len(grid) and not allowed.is_empty() else grid[:0]
    if len(places) < _LEAST_HOLES:
        raise Finger3dError(
            f"--carrier --key-mm {neck:g}: {len(places)} keyed holes fit on the base, {x1 - x0:.4g} x {z1 - z0:.4g} "
            f"mm, must be {_LEAST_HOLES} or more; choose a smaller --key-mm, --pour-mm or --riser"
        )
    return Keys(tuple((round(float(x), 9), round(float(z), 9)) for x, z in places), neck, head)


def _ticks(low: float, high: float, pitch: float, margin: float) -> np.ndarray:
    """Return equally spaced coordinates between two ends, symmetric, at least a pitch apart."""
    room = high - low - margin
    if room < 0.0:
        return np.empty(0)
    count = int(room / pitch) + 1
    return 0.5 * (low + high) + (np.arange(count) - 0.5 * (count - 1)) * (room / max(count - 1, 1))


def key_solids(holes: Keys, x: float, options: MoldOptions) -> list[Solid]:
    """Return the holes of the cavity at `x` as solids through the carrier."""
    cover = options.carrier_mm
    straight, slope = _heights(holes, cover)
    solids = []
    for kx, kz in holes.places:
        middle = kx + x
        solids += [
            cylinder((middle, -straight, kz), holes.neck_mm, straight, "y"),
            cone((middle, -straight - slope, kz), holes.head_mm, holes.neck_mm, slope, "y"),
            cylinder((middle, -cover, kz), holes.head_mm, cover - straight - slope, "y"),
        ]
    return solids


def finger_on_carrier(solid: Solid, carrier: Solid, rods: Sequence[Solid], cover_mm: float) -> Mapping[str, Solid]:
    """Return the solids of a finger on its carrier by their labels, the carrier's outer face on y = 0.

    Parameters
    ----------
    solid : the finger, base on y = 0
    carrier : the carrier below y = 0
    rods : the silicone in its holes; filled to the outer face
    cover_mm : thickness of the carrier

    Returns
    -------
    Mapping
        The silicone with the label "" and the carrier with the label "carrier".
    """
    from build123d import Pos

    silicone = solid.fuse(*rods) if rods else solid
    lifted = Pos(0, float(cover_mm), 0)
    return {
        "": one(lifted * silicone, "the finger on its carrier"),
        LABEL: one(lifted * carrier, LABEL),
    }
