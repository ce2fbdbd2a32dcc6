"""A printable mold of the sensor: two halves and a lid, built from the finger's CAD by booleans.

The sensor is cast upside down: the contact surface lies at the bottom of the cavity, where no air is trapped, and the
lid closes the base. The base will be bonded to a carrier, so marks of the pour hole and the vents do no harm there.

The halves open along z by default. The section of an extruded finger is constant along z, and that of a half ball
shrinks away from the middle, so neither has undercuts. The strips that carry the gauges run along z as well, and the
halves slide off along them. ``split = "x"`` serves bodies that narrow towards both ends of x. A body with undercuts
is refused, see `undercuts`.

The axes of the mold are those of the finger; with ``split = "x"`` they are rotated about y, so that the halves always
open along z. The lid begins at y = 0.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.geometry.tessellate import triangulated
from finger3d.mechanics.gauges import Gauge
from finger3d.mold.demould import box, is_base, undercuts
from finger3d.mold.options import RIM_MM, MoldOptions
from finger3d.mold.shell import volume

if TYPE_CHECKING:
    from build123d import Shape, Solid


COVER_MM = 0.5
"""Least cover of silicone between a foil and the surface of the cavity."""

THIN = 0.7
"""Ratio of the diameter of a pattern's thin peg to that of the other pegs."""

_OVERLAP_TOLERANCE = 1e-6  # relative volume that booleans leave between faces in contact
_PROBE_HEIGHT_MM = 0.01  # of the disc that tests whether an opening lies over the cavity


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


@dataclass(frozen=True)
class Ports:
    """Openings of the lid, mm: the pour hole at the origin, and two vents, as (x, z)."""

    pour_mm: float
    funnel_mm: float
    vent_mm: float
    vents: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Mold:
    """A mold in its assembled position, build123d solids in mm.

    Attributes
    ----------
    body : the cavity: the finger enlarged by the shrinkage
    parts : half_a (z above the split), half_b (below, with the pegs), lid
    slots : the volumes of the strips, with their gaps
    pegs, holes : pegs of half_b, and their holes in half_a
    lid_pegs, lid_holes : between the lid and both halves
    outline : low and high corner (3,), mm, of the two halves together
    """

    options: MoldOptions
    body: Solid
    parts: dict[str, Solid]
    slots: tuple[Solid, ...]
    foils: tuple[FoilSlot, ...]
    ports: Ports
    pegs: tuple[Solid, ...]
    holes: tuple[Solid, ...]
    lid_pegs: tuple[Solid, ...]
    lid_holes: tuple[Solid, ...]
    outline: tuple[Float, Float]

    @property
    def silicone_mm3(self) -> float:
        """Volume of the cavity."""
        return volume(self.body)


def mold(solid: Solid, gauges: Sequence[FoilSlot], options: MoldOptions) -> Mold:
    """Build a mold around a finger (y up, base on y = 0, mm).

    Raises
    ------
    Finger3dError
        If the split plane misses the body, the body has an undercut, a foil does not fit, the lid has no room
        for its openings, or two parts of the mold would overlap.
    """
    from build123d import Rot

    if options.split == "x" and gauges:
        raise Finger3dError(
            f'--split x: the strips of gauge "{gauges[0].names[0]}" run along z and would lock halves that open along '
            "x; use --split z, or a scene without gauges"
        )
    _check_split(solid, options)
    behind = undercuts(solid, options.split, options.split_mm)
    if behind:
        other = "x" if options.split == "z" else "z"
        free = not undercuts(solid, other, 0.0) and not (other == "x" and gauges)
        advice = f"--split {other} would do" if free else "a mold of two halves cannot be taken off; change the body"
        raise Finger3dError(f"--split {options.split} --split-mm {options.split_mm:g}: {behind}; {advice}")
    body = solid.scale(options.scale) if options.shrinkage else solid
    if options.split == "x":
        body = Rot(0, -90, 0) * body
    foils = tuple(gauges)
    _check_foils(body, foils, options)
    made = _assemble(body, foils, options)
    _check_parts(made)
    return made


def _assemble(body: Solid, foils: tuple[FoilSlot, ...], options: MoldOptions) -> Mold:
    """Build all parts: outer box, cavity, slots, pegs and holes, openings; then cut the box into halves and lid."""
    low, high = box(body)
    w, split = options.wall_mm, options.split_mm * options.scale
    places, top = _peg_places(low, high, options)
    outer_low, outer_high = np.array([low[0] - w, 0.0, low[2] - w]), np.array([high[0] + w, top, high[2] + w])
    slots = tuple(_slot(foil, options, outer_low[2], outer_high[2]) for foil in foils)
    ports = _ports(body, options)
    loose = options.clearance_mm
    sizes = [options.peg_mm * THIN] + [options.peg_mm] * (len(places) - 1)
    pegs = tuple(_peg((x, y, split), d, options.peg_mm) for (x, y), d in zip(places, sizes, strict=True))
    holes = tuple(
        _peg((x, y, split), d + 2.0 * loose, options.hole_depth_mm) for (x, y), d in zip(places, sizes, strict=True)
    )
    corners = list(itertools.product((low[0] - w / 2, high[0] + w / 2), (low[2] - w / 2, high[2] + w / 2)))
    sizes = [options.peg_mm * THIN] + [options.peg_mm] * 3
    lid_pegs = tuple(_upright((x, 0.0, z), d, options.peg_mm) for (x, z), d in zip(corners, sizes, strict=True))
    lid_holes = tuple(
        _upright((x, 0.0, z), d + 2.0 * loose, options.hole_depth_mm) for (x, z), d in zip(corners, sizes, strict=True)
    )
    middle = np.array([outer_low[0], 0.0, split])
    front = _between(middle, outer_high) - [body, *slots, *holes, *lid_holes]
    back = _between(outer_low, np.array([outer_high[0], top, split])) - [body, *slots, *lid_holes] + list(pegs)
    plate = _between(
        np.array([outer_low[0], -options.lid_mm, outer_low[2]]), np.array([outer_high[0], 0, outer_high[2]])
    )
    lid = plate + list(lid_pegs) - _openings(ports, options)
    parts = {name: _one(name, part) for name, part in (("half_a", front), ("half_b", back), ("lid", lid))}
    return Mold(
        options=options,
        body=body,
        parts=parts,
        slots=slots,
        foils=foils,
        ports=ports,
        pegs=pegs,
        holes=holes,
        lid_pegs=lid_pegs,
        lid_holes=lid_holes,
        outline=(outer_low, outer_high),
    )


def _between(low: Float, high: Float) -> Solid:
    from build123d import Box, Pos

    size, middle = high - low, 0.5 * (low + high)
    return Pos(*map(float, middle)) * Box(*map(float, size))


def _peg(at: tuple[float, float, float], diameter: float, length: float) -> Solid:
    """Return a cylinder along z that starts at a point."""
    from build123d import Align, Cylinder, Pos

    centre = (Align.CENTER, Align.CENTER, Align.MIN)
    return Pos(*map(float, at)) * Cylinder(diameter / 2.0, length, align=centre)


def _upright(at: tuple[float, float, float], diameter: float, length: float) -> Solid:
    """Return a cylinder along y that starts at a point."""
    from build123d import Align, Cylinder, Pos, Rot

    centre = (Align.CENTER, Align.CENTER, Align.MIN)
    return Pos(*map(float, at)) * Rot(-90, 0, 0) * Cylinder(diameter / 2.0, length, align=centre)


def _peg_places(low: Float, high: Float, options: MoldOptions) -> tuple[list[tuple[float, float]], float]:
    """Return the places (x, y) of the halves' pegs, clear of body and lid pegs, and the top of the halves."""
    w, around = options.wall_mm, options.peg_mm / 2.0 + options.clearance_mm + RIM_MM
    near = options.hole_depth_mm + around
    far = max(float(high[1]) + w / 2.0, near)
    rows = [near, far] if far - near >= 2.0 * around else [far]
    sides = [float(low[0]) - w / 2.0, float(high[0]) + w / 2.0]
    return [(x, y) for y in rows for x in sides], max(float(high[1]) + w, far + around)


def _slot(foil: FoilSlot, options: MoldOptions, z_low: float, z_high: float) -> Solid:
    """Return the strip with its gaps through both walls; its place is scaled by the shrinkage, its section is not."""
    gap = 2.0 * options.slot_gap_mm
    return _strip(foil, options.scale, foil.length_mm + gap, foil.thickness_mm + gap, float(z_low), float(z_high))


def _strip(foil: FoilSlot, scale: float, length: float, thickness: float, z_low: float, z_high: float) -> Solid:
    from build123d import Box, Pos, Rot

    at = Pos(foil.x_mm * scale, foil.y_mm * scale, 0.5 * (z_low + z_high))
    return at * Rot(0, 0, float(np.degrees(foil.angle))) * Box(length, thickness, z_high - z_low)


def _ports(body: Solid, options: MoldOptions) -> Ports:
    """Return the openings, as large as the base allows or as given."""
    base = [f for f in body.faces() if is_base(f)]
    corners = np.array([[*getattr(f.bounding_box(optimal=True), end)] for f in base for end in ("min", "max")])
    low, high = corners.min(axis=0)[::2], corners.max(axis=0)[::2]
    along = int(np.argmax(high - low))
    size = float((high - low).min())
    vent = min(2.0, 0.1 * size) if options.vent_mm is None else options.vent_mm
    pour = min(6.0, 0.3 * size) if options.pour_mm is None else options.pour_mm
    vents = []
    for sign, end in ((1.0, low[along]), (-1.0, high[along])):
        at = [0.0, 0.0]
        at[along] = float(end + sign * vent)
        vents.append((at[0], at[1]))
    room = min(abs(v[along]) for v in vents) - vent / 2.0 - RIM_MM
    if not pour / 2.0 <= room or min(v[along] * s for v, s in zip(vents, (-1.0, 1.0), strict=True)) < 0.0:
        raise Finger3dError(
            f"--pour-mm {pour:g} --vent-mm {vent:g}: do not fit on the base, {high[0] - low[0]:.4g} x "
            f"{high[1] - low[1]:.4g} mm, with {RIM_MM:g} mm between them; must be smaller"
        )
    ports = Ports(pour, max(pour, min(2.0 * pour, 2.0 * room, size)), vent, (vents[0], vents[1]))
    for name, (x, z), d in (("pour", (0.0, 0.0), pour), *(("vent", v, vent) for v in vents)):
        probe = _upright((x, 0.0, z), d, _PROBE_HEIGHT_MM)
        if _common(probe, body) < (1.0 - 1e-3) * probe.volume:
            raise Finger3dError(
                f"--{name}-mm {d:g}: at x = {x:.4g}, z = {z:.4g} mm the hole does not open into the cavity whole; "
                "must be smaller"
            )
    return ports


def _openings(ports: Ports, options: MoldOptions) -> list[Solid]:
    """Return the funnel, wider outside, and the vents as solids through the lid."""
    from build123d import Align, Cone, Pos, Rot

    centre = (Align.CENTER, Align.CENTER, Align.MIN)
    funnel = (
        Pos(0, -options.lid_mm, 0)
        * Rot(-90, 0, 0)
        * Cone(ports.funnel_mm / 2.0, ports.pour_mm / 2.0, options.lid_mm, align=centre)
    )
    return [funnel, *(_upright((x, -options.lid_mm, z), ports.vent_mm, options.lid_mm) for x, z in ports.vents)]


def _one(name: str, shape: Shape) -> Solid:
    solids = shape.solids()
    if len(solids) != 1 or not solids[0].is_valid:
        raise Finger3dError(f"mold: {name} falls into {len(solids)} pieces; choose a thicker --wall-mm")
    solids[0].label = name
    return solids[0]


def _common(a: Shape, b: Shape) -> float:
    """Return the common volume of two solids, mm3."""
    shared = a & b
    return sum(float(s.volume) for s in shared.solids()) if shared is not None else 0.0


# --- refusals ---------------------------------------------------------------------------------------------------------


def _check_split(solid: Solid, options: MoldOptions) -> None:
    low, high = box(solid)
    axis = 0 if options.split == "x" else 2
    if not low[axis] < options.split_mm < high[axis]:
        raise Finger3dError(
            f"--split-mm {options.split_mm:g}: the split plane misses the finger; must be between {low[axis]:.6g} and "
            f"{high[axis]:.6g} mm along {options.split}"
        )


def foils(
    gauges: Sequence[Gauge], options: MoldOptions, section_mm: tuple[float, float] | None
) -> tuple[FoilSlot, ...]:
    """Return the slots of a scene's gauges; gauges that differ in z only are on one strip.

    Parameters
    ----------
    section_mm : thickness and width of every foil, from the scene; None for those of the options
    """
    thickness, width = section_mm or (options.foil_thickness_mm, options.foil_width_mm)
    strips: dict[tuple[float, ...], list[Gauge]] = {}
    for g in gauges:
        key = (g.x_mm, g.y_mm, g.angle % np.pi, g.length_mm)
        strips.setdefault(tuple(round(v, 9) for v in key), []).append(g)

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

    return tuple(strip(on) for on in strips.values())


def _check_foils(body: Solid, foils: tuple[FoilSlot, ...], options: MoldOptions) -> None:
    gap = 2.0 * options.slot_gap_mm
    low, high = box(body)
    slots = []
    for foil in foils:
        name = f'gauge "{foil.names[0]}"'
        for z in foil.z_mm:
            ends = z * options.scale - foil.width_mm / 2.0, z * options.scale + foil.width_mm / 2.0
            around = 2.0 * COVER_MM
            room = _strip(foil, options.scale, foil.length_mm + around, foil.thickness_mm + around, *ends)
            if _common(room, body) < (1.0 - _OVERLAP_TOLERANCE) * room.volume:
                raise Finger3dError(
                    f"{name}: its foil, {foil.length_mm:g} x {foil.width_mm:g} x {foil.thickness_mm:g} mm, is not in "
                    f"the silicone with {COVER_MM:g} mm around it; move it inwards, or choose a shorter foil"
                )
        slots.append(_strip(foil, options.scale, foil.length_mm + gap, foil.thickness_mm + gap, low[2], high[2]))
    for (i, a), (j, b) in itertools.combinations(enumerate(slots), 2):
        apart = float(a.distance_to(b))
        if apart < RIM_MM:
            raise Finger3dError(
                f'gauge "{foils[j].names[0]}": its strip is {apart:.3g} mm from that of gauge "{foils[i].names[0]}", '
                f"must be {RIM_MM:g} mm away or more; move one, or choose shorter foils"
            )


def overlaps(made: Mold) -> dict[str, float]:
    """Return the common volume (mm3) of each pair of parts in the assembled position, the cast body included."""
    solids = {**made.parts, "sensor": made.body}
    return {f"{a}, {b}": _common(solids[a], solids[b]) for a, b in itertools.combinations(solids, 2)}


def _check_parts(made: Mold) -> None:
    bad = {pair: v for pair, v in overlaps(made).items() if v > _OVERLAP_TOLERANCE * made.silicone_mm3}
    if bad:
        pair = max(bad, key=lambda p: bad[p])
        raise Finger3dError(f"mold: {pair} would overlap by {bad[pair]:.3g} mm3; choose other sizes of wall or pegs")


def strips(made: Mold) -> Triangles | None:
    """Return the strips of all gauges, longer than the mold, for a picture; None without gauges."""
    if not made.foils:
        return None
    low, high = made.outline
    out = 0.25 * float(high[2] - low[2])
    boxes = []
    for f in made.foils:
        boxes.append(
            _strip(f, made.options.scale, f.length_mm, f.thickness_mm, float(low[2]) - out, float(high[2]) + out)
        )
    points, faces, at = [], [], 0
    for strip in boxes:
        p, t, _ = triangulated(strip, list(strip.faces()), 1.0, 0.5)
        points.append(p)
        faces.append(t + at)
        at += len(p)
    return Triangles(np.vstack(points), np.vstack(faces))
