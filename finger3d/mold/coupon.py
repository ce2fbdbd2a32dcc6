"""A fit coupon: one peg, and holes with several clearances, to measure which clearance a printer needs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from finger3d.mold.options import MoldOptions
from finger3d.mold.solids import between, cylinder, one, peg

if TYPE_CHECKING:
    from build123d import Solid

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
