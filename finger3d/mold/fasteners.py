"""What aligns, seals and holds a mold: pegs, tongues and grooves, screws with nuts, rubber bands, and notches.

The seal follows the outline of the cavities in the parting plane of the halves, and the outline of their bases under
the lid: a tongue in a groove, or a groove for a cord of silicone. Both are part of regions between two offsets of these
outlines. One peg of each pattern is thin, so that parts fit one way only.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from finger3d.geometry.surface import Triangles
from finger3d.mold.cover import base_region
from finger3d.mold.layout import Layout
from finger3d.mold.options import BAND_DEPTH_MM, TONGUE_HEIGHT_MM, TONGUE_MM, MoldOptions, standard_length
from finger3d.mold.regions import prisms, rectangle, section, widened
from finger3d.mold.solids import Feature, between, cylinder, hexagon, one, peg

if TYPE_CHECKING:
    from build123d import Solid
    from manifold3d import CrossSection


THIN = 0.7
"""Ratio of the diameter of a pattern's thin peg to that of the other pegs."""

_HEAD = 1.8  # diameter of a pin's head over that of the pin


@dataclass(frozen=True)
class Pegs:
    """Pegs and their holes, in the same order, the thin one first."""

    pegs: tuple[Solid, ...]
    holes: tuple[Solid, ...]


def half_pegs(layout: Layout, options: MoldOptions) -> Pegs:
    """Return the pegs of half B and their holes in half A."""
    away = options.peg_distance_mm
    places = [
        (x, y, layout.split) for y in layout.rows for x in (float(layout.low[0]) - away, float(layout.high[0]) + away)
    ]
    sizes = [options.peg_mm * THIN] + [options.peg_mm] * (len(places) - 1)
    return Pegs(
        tuple(peg(p, d, options.peg_mm, "z") for p, d in zip(places, sizes, strict=True)),
        tuple(
            cylinder(p, d + 2.0 * options.gap_mm, options.hole_depth_mm, "z")
            for p, d in zip(places, sizes, strict=True)
        ),
    )


def _corners(layout: Layout, options: MoldOptions) -> list[tuple[tuple[float, float, float], float]]:
    """Return the places of the pegs of the lid, and their diameters."""
    away = options.peg_distance_mm
    ends = itertools.product(
        (float(layout.low[0]) - away, float(layout.high[0]) + away),
        (float(layout.low[2]) - away, float(layout.high[2]) + away),
    )
    sizes = [options.peg_mm * THIN] + [options.peg_mm] * 3
    return [((x, 0.0, z), d) for (x, z), d in zip(ends, sizes, strict=True)]


def lid_pegs(layout: Layout, options: MoldOptions) -> Pegs:
    """Return the pegs of the lid and their holes in both halves."""
    corners = _corners(layout, options)
    return Pegs(
        tuple(peg(p, d, options.peg_mm, "y") for p, d in corners),
        tuple(cylinder(p, d + 2.0 * options.gap_mm, options.hole_depth_mm, "y") for p, d in corners),
    )


def carrier_pins(layout: Layout, options: MoldOptions) -> Feature:
    """Return loose pins with heads, which align a carrier, and the holes for them in carrier and halves.

    The carrier has no pegs of its own: its holes serve to mount the finger. The thin pin is at one corner.
    """
    holes, through, pins = [], [], {}
    for i, ((x, _, z), d) in enumerate(_corners(layout, options)):
        outside = -options.carrier_mm
        hole = d + 2.0 * options.gap_mm
        holes.append(cylinder((x, 0.0, z), hole, options.hole_depth_mm, "y"))
        through.append(cylinder((x, outside, z), hole, options.carrier_mm, "y"))
        head = cylinder((x, outside, z), _HEAD * d, 2.0 * options.rim_mm, "-y")
        pin = peg((x, outside, z), d, options.carrier_mm + options.peg_mm, "y")
        pins[f"pin_{i + 1}"] = (head + pin).solids()[0]
    return Feature(cut={"half_a": holes, "half_b": holes, "lid": through}, parts=pins)


CLEARANCES = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
"""Clearances of the holes over that of the mold."""

_NOTCH_MM = 1.0  # width, depth and distance of the notches that number the holes


def coupon_clearances(options: MoldOptions) -> tuple[float, ...]:
    """Return the gaps all around the peg, mm, of the holes with 1, 2, ... notches."""
    return tuple(round(share * (options.gap_mm or options.machine.clearance_mm), 3) for share in CLEARANCES)


def coupon(options: MoldOptions) -> dict[str, Solid]:
    """Return a plate with a peg of the mold, and a bar with numbered holes, as they lie on the bed (z up).

    The peg of the mold is printed as in half B, upright, and the holes as in half A.
    """
    d, rim = options.peg_mm, options.rim_mm
    gaps = coupon_clearances(options)
    side = 3.0 * d
    plate = between((-side / 2.0, -side / 2.0, 0.0), (side / 2.0, side / 2.0, 2.0 * rim))
    parts = {"coupon_peg": one(plate + peg((0.0, 0.0, 2.0 * rim), d, d, "z"), "coupon_peg")}
    notches = 2.0 * _NOTCH_MM * (len(gaps) + 1)
    pitch = max(d + 2.0 * gaps[-1] + 2.0 * rim, notches)
    deep, thick = d + 2.0 * gaps[-1] + 2.0 * rim + 2.0 * _NOTCH_MM, options.hole_depth_mm + rim
    bar = between((0.0, 0.0, 0.0), (pitch * len(gaps), deep, thick))
    tools = []
    for i, gap in enumerate(gaps):
        x = (i + 0.5) * pitch
        tools.append(cylinder((x, deep - rim - d / 2.0 - gaps[-1], rim), d + 2.0 * gap, thick - rim, "z"))
        for k in range(i + 1):
            left = x + (2.0 * k - i - 0.5) * _NOTCH_MM
            tools.append(between((left, 0.0, 0.0), (left + _NOTCH_MM, _NOTCH_MM, thick)))
    parts["coupon_holes"] = one(bar - tools, "coupon_holes")
    return parts


def seal(bodies: Sequence[Triangles], layout: Layout, options: MoldOptions) -> Feature:
    """Return the tongues and grooves of a mold; nothing without a seal.

    Parameters
    ----------
    bodies : surface of every cavity, in place
    """
    if options.seal == "none":
        return Feature()
    width, depth = options.groove_mm
    bases = _union([base_region(body) for body in bodies])
    # The slice lies just beside the plane: a body may have a face on it.
    cut = _union([section(body, "z", layout.split + 1e-6 * float(body.size)) for body in bodies])
    middle = options.rim_mm + width / 2.0
    if options.seal == "cord":
        upright = prisms(_ring(cut, middle, width) ^ _above(layout, 0.0), "z", layout.split, depth)
        flat = prisms(_ring(bases, middle, width), "y", 0.0, depth)
        return Feature(cut={"half_a": [*upright, *flat], "half_b": flat})
    # With a carrier nothing may stand on it: it becomes the finger's base.
    lid = not options.carrier
    start = depth + options.rim_mm if lid else 0.0
    tongue = prisms(
        _ring(cut, middle, TONGUE_MM) ^ _above(layout, start + options.gap_mm), "z", layout.split, TONGUE_HEIGHT_MM
    )
    groove = prisms(_ring(cut, middle, width) ^ _above(layout, start), "z", layout.split, depth)
    if not lid:
        return Feature(add={"half_b": tongue}, cut={"half_a": groove})
    flat = prisms(_ring(bases, middle, width), "y", 0.0, depth)
    return Feature(
        add={"half_b": tongue, "lid": prisms(_ring(bases, middle, TONGUE_MM), "y", 0.0, TONGUE_HEIGHT_MM)},
        cut={"half_a": [*groove, *flat], "half_b": flat},
    )


def _ring(region: CrossSection, middle: float, width: float) -> CrossSection:
    """Return the points whose distance from a region differs from `middle` by at most half the width."""
    return widened(region, middle + width / 2.0) - widened(region, middle - width / 2.0)


def _above(layout: Layout, y: float) -> CrossSection:
    low, high = layout.outer_low, layout.outer_high
    return rectangle((float(low[0]), y), (float(high[0]), float(high[1])))


def _union(regions: Sequence[CrossSection]) -> CrossSection:
    from manifold3d import CrossSection, OpType

    return CrossSection.batch_boolean(list(regions), OpType.Add)


_GRIP_MM = 0.2  # by which a nut lies deeper than its own height at least


@dataclass(frozen=True)
class Bolts:
    """Screws of a mold: how many, their length (mm), and the depth (mm) of the traps of their nuts."""

    number: int
    length_mm: float
    trap_mm: float


def bolts(layout: Layout, options: MoldOptions) -> Bolts | None:
    """Return the screws along z; None without screws."""
    if options.fasten != "screws":
        return None
    thick = float(layout.outer_high[2] - layout.outer_low[2])
    length = standard_length(thick - _GRIP_MM)
    return Bolts(2 * len(_lug_rows(layout, options)), length, thick - length + options.screw_sizes.nut_mm)


def _lug_mm(options: MoldOptions) -> float:
    """Return the side of a lug, which holds a nut with a rim around it."""
    screw = options.screw_sizes
    widest = max(screw.corners_mm + 2.0 * options.gap_mm, screw.head_mm, screw.hole_mm)
    return widest + 2.0 * options.rim_mm


def _lug_rows(layout: Layout, options: MoldOptions) -> list[float]:
    """Return y of the lugs' middles: near the lid and near the top, or one of a low mold."""
    lug, top = _lug_mm(options), layout.top
    return [lug / 2.0, top - lug / 2.0] if top >= 3.0 * lug else [max(top / 2.0, lug / 2.0)]


def screws(layout: Layout, options: MoldOptions) -> Feature:
    """Return lugs at both ends of the halves, through holes along z, and hexagonal traps in half A."""
    bolt = bolts(layout, options)
    if bolt is None:
        return Feature()
    lug, screw = _lug_mm(options), options.screw_sizes
    low, high = float(layout.outer_low[2]), float(layout.outer_high[2])
    ears: dict[str, list[Solid]] = {"half_a": [], "half_b": []}
    holes, traps = [], []
    for y in _lug_rows(layout, options):
        for x0, x1 in (
            (layout.outer_low[0] - lug, layout.outer_low[0] + options.rim_mm),
            (layout.outer_high[0] - options.rim_mm, layout.outer_high[0] + lug),
        ):
            x = float(x0) + lug / 2.0 if x0 < layout.outer_low[0] else float(x1) - lug / 2.0
            ears["half_a"].append(between((x0, y - lug / 2.0, layout.split), (x1, y + lug / 2.0, high)))
            ears["half_b"].append(between((x0, y - lug / 2.0, low), (x1, y + lug / 2.0, layout.split)))
            holes.append(cylinder((x, y, low), screw.hole_mm, high - low, "z"))
            traps.append(hexagon((x, y, high), screw.flats_mm + 2.0 * options.gap_mm, bolt.trap_mm, "-z"))
    return Feature(add=ears, cut={"half_a": [*holes, *traps], "half_b": holes})


def cover_groove_mm(options: MoldOptions) -> float:
    """Return the depth of the grooves for bands in the lid; a carrier keeps its outer face, the base of the finger."""
    if options.fasten == "none" or options.carrier:
        return 0.0
    return max(min(BAND_DEPTH_MM, options.cover_mm - 2.0 * options.rim_mm), 0.0)


def band_grooves(layout: Layout, options: MoldOptions) -> Feature:
    """Return grooves for bands: around lid and halves, and, without screws, around the halves."""
    if options.fasten == "none":
        return Feature()
    low, high, depth = layout.outer_low, layout.outer_high, BAND_DEPTH_MM
    below = -options.cover_mm
    loops = []
    inset = options.rim_mm + options.band_mm / 2.0
    cover_depth = cover_groove_mm(options)
    for x in (float(low[0]) + inset, float(high[0]) - inset):
        a, b = x - options.band_mm / 2.0, x + options.band_mm / 2.0
        loops += [
            between((a, below, low[2]), (b, high[1], low[2] + depth)),
            between((a, below, high[2] - depth), (b, high[1], high[2])),
            between((a, high[1] - depth, low[2]), (b, high[1], high[2])),
        ]
        if cover_depth > 0.0:
            loops.append(between((a, below, low[2]), (b, below + cover_depth, high[2])))
    around = []
    for y in _band_rows(layout, options) if options.fasten == "bands" else ():
        a, b = y - options.band_mm / 2.0, y + options.band_mm / 2.0
        around += [
            between((low[0], a, low[2]), (low[0] + depth, b, high[2])),
            between((high[0] - depth, a, low[2]), (high[0], b, high[2])),
            between((low[0], a, low[2]), (high[0], b, low[2] + depth)),
            between((low[0], a, high[2] - depth), (high[0], b, high[2])),
        ]
    return Feature(cut={"half_a": [*loops, *around], "half_b": [*loops, *around], "lid": loops})


def _band_rows(layout: Layout, options: MoldOptions) -> list[float]:
    """Return y of the bands around the halves: two, or one of a low mold."""
    two = layout.top >= 4.0 * (options.band_mm + options.rim_mm)
    return [0.25 * layout.top, 0.75 * layout.top] if two else [0.5 * layout.top]


def pry_notches(layout: Layout, options: MoldOptions) -> Feature:
    """Return notches for a screwdriver: in half A at the top of the parting face, and at both ends of the lid."""
    if not options.pry:
        return Feature()
    wide, deep = 2.0 * options.peg_mm, 0.75 * options.peg_mm
    high = min(0.4 * options.peg_mm, options.cover_mm - cover_groove_mm(options) - options.rim_mm)
    # Beside the pegs at the ends of the mold.
    inset = options.band_depth_mm + 2.0 * options.rim_mm + options.peg_hole_mm + wide / 2.0
    middle = 0.5 * float(layout.outer_low[0] + layout.outer_high[0])
    ends = [float(layout.outer_low[0]) + inset, float(layout.outer_high[0]) - inset]
    places = ends if ends[1] - ends[0] >= wide + 2.0 * options.rim_mm else [middle]
    top, z = layout.top, layout.split
    parting = [between((x - wide / 2.0, top - deep, z), (x + wide / 2.0, top, z + high)) for x in places]
    lifted = [
        between((x, -high, z - wide / 2.0), (x + sign * deep, 0.0, z + wide / 2.0))
        if sign > 0
        else between((x - deep, -high, z - wide / 2.0), (x, 0.0, z + wide / 2.0))
        for x, sign in ((float(layout.outer_low[0]), 1.0), (float(layout.outer_high[0]), -1.0))
    ]
    return Feature(cut={"half_a": parting, "lid": lifted})
