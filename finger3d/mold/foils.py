"""Strips that carry the foils of gauges through the mold, and their slots."""

from __future__ import annotations

import itertools
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
from finger3d.mold.options import MoldOptions

if TYPE_CHECKING:
    from build123d import Solid

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
