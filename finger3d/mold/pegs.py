"""Pegs that align the halves with each other and with the lid; one of each pattern is thin, so that parts fit one way
only."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

from finger3d.mold.features import Feature
from finger3d.mold.layout import Layout
from finger3d.mold.options import MoldOptions
from finger3d.mold.solids import cylinder, peg

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
