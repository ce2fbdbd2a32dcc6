"""What holds a mold together: screws through lugs, with traps for their nuts, or grooves for rubber bands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from finger3d.mold.features import Feature
from finger3d.mold.hardware import standard_length
from finger3d.mold.layout import Layout
from finger3d.mold.options import BAND_DEPTH_MM, MoldOptions
from finger3d.mold.solids import between, cylinder, hexagon

if TYPE_CHECKING:
    from build123d import Solid

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
