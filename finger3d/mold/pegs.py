"""Pegs that align the halves and the lid, one of each pattern thin so that parts fit one way only; and a fit coupon."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

from finger3d.mold.features import Feature
from finger3d.mold.layout import Layout
from finger3d.mold.options import MoldOptions
from finger3d.mold.solids import between, cylinder, one, peg

if TYPE_CHECKING:
    from build123d import Solid

if TYPE_CHECKING:
    from build123d import Solid


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
