"""Places of cavity and walls in a mold, and the pegs and screws that align and hold it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float
from finger3d.mold.options import PEG_MM, SCREWS, WALL_MM, MoldOptions, standard_length
from finger3d.mold.solids import Axis, Feature, Place, between, cylinder, hexagon, peg

if TYPE_CHECKING:
    from build123d import Solid


@dataclass(frozen=True)
class Layout:
    """Places in the axes of the mold, mm.

    Attributes
    ----------
    low, high : corners (3,) of the box around the cavity
    outer_low, outer_high : corners (3,) of the box of both halves, which begins at y = 0
    split : z at which the halves meet
    rows : y of the pegs between the halves
    """

    low: Float
    high: Float
    outer_low: Float
    outer_high: Float
    split: float
    rows: tuple[float, ...]

    @property
    def top(self) -> float:
        """Height of the halves, y."""
        return float(self.outer_high[1])


def layout_of(low: Float, high: Float, options: MoldOptions) -> Layout:
    """Place the walls around the cavity, and rows of pegs clear of the pegs of the lid.

    Parameters
    ----------
    low, high : corners (3,) of the box around the cavity, mm
    """
    away = options.peg_distance_mm
    around = options.peg_hole_mm / 2.0 + options.rim_mm
    near = PEG_MM + options.gap_mm + around
    far = max(float(high[1]) + away, near)
    rows = (near, far) if far - near >= 2.0 * around else (far,)
    outer_low = np.array([low[0] - WALL_MM, 0.0, low[2] - WALL_MM])
    outer_high = np.array([high[0] + WALL_MM, max(float(high[1]) + WALL_MM, far + around), high[2] + WALL_MM])
    return Layout(low, high, outer_low, outer_high, options.split_mm * options.scale, rows)


THIN = 0.7
"""Ratio of the diameter of a pattern's thin peg to that of the other pegs."""


def pegs(
    places: Sequence[Place], diameter: float, length: float, axis: Axis, gap: float
) -> tuple[list[Solid], list[Solid]]:
    """Return pegs, the first one thin, and their holes with a gap all around, mm."""
    sizes = [THIN * diameter] + [diameter] * (len(places) - 1)
    return (
        [peg(place, d, length, axis) for place, d in zip(places, sizes, strict=True)],
        [cylinder(place, d + 2.0 * gap, length + gap, axis) for place, d in zip(places, sizes, strict=True)],
    )


def half_pegs(layout: Layout, options: MoldOptions) -> Feature:
    """Return the pegs of half B and their holes in half A."""
    away = options.peg_distance_mm
    ends = float(layout.low[0]) - away, float(layout.high[0]) + away
    places = [(x, y, layout.split) for y in layout.rows for x in ends]
    made, holes = pegs(places, PEG_MM, PEG_MM, "z", options.gap_mm)
    return Feature(add={"half_b": made}, cut={"half_a": holes})


def lid_pegs(layout: Layout, options: MoldOptions) -> Feature:
    """Return the pegs of the lid and their holes in both halves."""
    away = options.peg_distance_mm
    ends = ((float(layout.low[i]) - away, float(layout.high[i]) + away) for i in (0, 2))
    places = [(x, 0.0, z) for x, z in itertools.product(*ends)]
    made, holes = pegs(places, PEG_MM, PEG_MM, "y", options.gap_mm)
    return Feature(add={"lid": made}, cut={"half_a": holes, "half_b": holes})


_GRIP_MM = 0.2  # by which a nut lies deeper than its own height at least


@dataclass(frozen=True)
class Bolts:
    """Screws of a mold: how many, their length (mm), and the depth (mm) of the traps of their nuts."""

    number: int
    length_mm: float
    trap_mm: float


def bolts(layout: Layout, options: MoldOptions) -> Bolts | None:
    """Return the screws along z; None without screws."""
    if options.screw == "none":
        return None
    thick = float(layout.outer_high[2] - layout.outer_low[2])
    length = standard_length(thick - _GRIP_MM)
    return Bolts(2 * len(_lug_rows(layout, options)), length, thick - length + SCREWS[options.screw].nut_mm)


def _lug_mm(options: MoldOptions) -> float:
    """Return the side of a lug, which holds a nut with a rim around it."""
    screw = SCREWS[options.screw]
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
    lug, screw = _lug_mm(options), SCREWS[options.screw]
    low, high = float(layout.outer_low[2]), float(layout.outer_high[2])
    ears: dict[str, list[Solid]] = {"half_a": [], "half_b": []}
    holes, traps = [], []
    for y in _lug_rows(layout, options):
        for end, sign in ((float(layout.outer_low[0]), -1.0), (float(layout.outer_high[0]), 1.0)):
            x = end + sign * lug / 2.0
            x0, x1 = sorted((end - sign * options.rim_mm, end + sign * lug))
            ears["half_a"].append(between((x0, y - lug / 2.0, layout.split), (x1, y + lug / 2.0, high)))
            ears["half_b"].append(between((x0, y - lug / 2.0, low), (x1, y + lug / 2.0, layout.split)))
            holes.append(cylinder((x, y, low), screw.hole_mm, high - low, "z"))
            traps.append(hexagon((x, y, high), screw.flats_mm + 2.0 * options.gap_mm, bolt.trap_mm, "-z"))
    return Feature(add=ears, cut={"half_a": [*holes, *traps], "half_b": holes})
