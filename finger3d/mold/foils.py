"""Strips that carry the foils of gauges through the mold, their slots, and the plugs that close these."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.geometry.tessellate import triangulated
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mold.body import Body
from finger3d.mold.layout import Layout
from finger3d.mold.options import MoldOptions
from finger3d.mold.solids import Feature

if TYPE_CHECKING:
    from build123d import Solid

COVER_MM = 0.5
"""Least cover of silicone between a foil and the surface of the cavity."""

PLUG_MM, PLUG_HANDLE_MM = 3.0, 2.0
"""Depth of a plug in the wall, and height by which it stands out."""

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


def foils(
    gauges: Sequence[Gauge], options: MoldOptions, section_mm: tuple[float, float] | None
) -> tuple[FoilSlot, ...]:
    """Return the slots of a scene's gauges; gauges that differ in z only are on one strip.

    Parameters
    ----------
    section_mm : thickness and width of every foil, from the scene; None for those of the options
    """
    thickness, width = section_mm or (options.foil_thickness_mm, options.foil_width_mm)
    groups: dict[tuple[float, ...], list[Gauge]] = {}
    for g in gauges:
        key = (g.x_mm, g.y_mm, g.angle % np.pi, g.length_mm)
        groups.setdefault(tuple(round(v, 9) for v in key), []).append(g)

    def strip(on: list[Gauge]) -> FoilSlot:
        g, length = on[0], on[0].length_mm or options.foil_length_mm
        return FoilSlot(
            names=tuple(gauge.name for gauge in on),
            x_mm=g.x_mm,
            y_mm=g.y_mm,
            z_mm=tuple(gauge.z_mm for gauge in on),
            angle=g.angle,
            length_mm=length,
            thickness_mm=thickness,
            width_mm=width,
        )

    return tuple(strip(on) for on in groups.values())


def strip_solid(
    foil: FoilSlot, scale: float, length: float, thickness: float, z_low: float, z_high: float, x: float = 0.0
) -> Solid:
    """Return a box along z at the place of a foil in the cavity at `x`; its section is not scaled."""
    from build123d import Box, Pos, Rot

    at = Pos(foil.x_mm * scale + x, foil.y_mm * scale, 0.5 * (z_low + z_high))
    return at * Rot(0, 0, float(np.degrees(foil.angle))) * Box(length, thickness, z_high - z_low)


def slot(foil: FoilSlot, layout: Layout, options: MoldOptions, x: float) -> Solid:
    """Return the strip with its gaps through both walls."""
    gap = 2.0 * options.slot_gap_mm
    ends = float(layout.outer_low[2]), float(layout.outer_high[2])
    return strip_solid(foil, options.scale, foil.length_mm + gap, foil.thickness_mm + gap, *ends, x)


def plugs(foils: Sequence[FoilSlot], layout: Layout, options: MoldOptions) -> Feature:
    """Return plugs in pockets of the outer faces; a slit lets each be pushed over its strip from one end of it."""
    if not options.plugs or not foils:
        return Feature()
    from build123d import Box, Pos, Rot

    pockets: dict[str, list[Solid]] = {"half_a": [], "half_b": []}
    parts: dict[str, Solid] = {}
    gap, rim = options.gap_mm, options.rim_mm
    for x, (i, foil) in itertools.product(layout.places, enumerate(foils, 1)):
        slit = foil.length_mm + 2.0 * options.slot_gap_mm, foil.thickness_mm + 2.0 * options.slot_gap_mm
        size = slit[0] + 4.0 * rim, slit[1] + 4.0 * rim
        for side, z, sign in (("half_a", layout.outer_high[2], 1.0), ("half_b", layout.outer_low[2], -1.0)):
            place = (
                Pos(foil.x_mm * options.scale + x, foil.y_mm * options.scale, float(z))
                * Rot(0, 0, float(np.degrees(foil.angle)))
            )  # fmt: skip
            pockets[side].append(place * Pos(0, 0, -sign * PLUG_MM / 2.0) * Box(*size, PLUG_MM))
            height = PLUG_MM + PLUG_HANDLE_MM
            middle = sign * (height / 2.0 - PLUG_MM)
            block = Box(size[0] - 2.0 * gap, size[1] - 2.0 * gap, height)
            cut = Pos(size[0] / 2.0, 0, 0) * Box(slit[0] + size[0], slit[1], height)
            number = f"{i}" if len(layout.places) == 1 else f"{layout.places.index(x) + 1}_{i}"
            parts[f"plug_{number}{side[-1]}"] = (place * Pos(0, 0, middle) * (block - cut)).solids()[0]
    return Feature(cut=pockets, parts=parts)


def check_foils(body: Body, foils: Sequence[FoilSlot], options: MoldOptions) -> None:
    """Raise a Finger3dError if a foil is not covered by silicone, or two slots or their plugs are too close."""
    gap = 2.0 * options.slot_gap_mm
    low, high = body.box
    slots = []
    beside = 4.0 * options.rim_mm if options.plugs else 0.0
    for foil in foils:
        name = f'gauge "{foil.names[0]}"'
        for z in foil.z_mm:
            ends = z * options.scale - foil.width_mm / 2.0, z * options.scale + foil.width_mm / 2.0
            around = 2.0 * COVER_MM
            room = strip_solid(foil, options.scale, foil.length_mm + around, foil.thickness_mm + around, *ends)
            if body.shared(room) < (1.0 - _TOLERANCE) * room.volume:
                raise Finger3dError(
                    f"{name}: its foil, {foil.length_mm:g} x {foil.width_mm:g} x {foil.thickness_mm:g} mm, is not in "
                    f"the silicone with {COVER_MM:g} mm around it; move it inwards, or choose a shorter foil"
                )
        size = foil.length_mm + gap + beside, foil.thickness_mm + gap + beside
        slots.append(strip_solid(foil, options.scale, *size, float(low[2]), float(high[2])))
    for (i, a), (j, b) in itertools.combinations(enumerate(slots), 2):
        apart = float(a.distance_to(b))
        if apart < options.rim_mm:
            what, further = ("plug", "leave out the plugs (--no-plugs), ") if beside else ("strip", "")
            raise Finger3dError(
                f'gauge "{foils[j].names[0]}": its {what} is {apart:.3g} mm from that of gauge "{foils[i].names[0]}", '
                f"must be {options.rim_mm:g} mm away or more; {further}move one, or choose shorter foils"
            )


def strips(foils: Sequence[FoilSlot], layout: Layout, options: MoldOptions) -> Triangles | None:
    """Return the strips of all gauges, longer than the mold, for a picture; None without gauges."""
    if not foils:
        return None
    low, high = float(layout.outer_low[2]), float(layout.outer_high[2])
    out = 0.25 * (high - low)
    points, faces, count = [], [], 0
    for x, f in itertools.product(layout.places, foils):
        strip = strip_solid(f, options.scale, f.length_mm, f.thickness_mm, low - out, high + out, x)
        p, t, _ = triangulated(strip, list(strip.faces()), 1.0, 0.5)
        points.append(p)
        faces.append(t + count)
        count += len(p)
    return Triangles(np.vstack(points), np.vstack(faces))
