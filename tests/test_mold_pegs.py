"""Pegs and pins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.mold.layout import layout_of
from finger3d.mold.options import MoldOptions
from finger3d.mold.pegs import THIN, carrier_pins, coupon, coupon_clearances, half_pegs, lid_pegs
from finger3d.mold.shell import shell
from finger3d.mold.slicer import check_print
from finger3d.mold.solids import LEAD_IN

AT = layout_of(np.array([-20.0, 0.0, -10.0]), np.array([20.0, 30.0, 10.0]), MoldOptions())


def test_one_peg_is_thin_and_all_have_a_lead_in() -> None:
    """Volume of a cylinder whose tip is a frustum of 0.7 times the diameter, 0.15 diameters high."""
    for found in (half_pegs(AT, MoldOptions()), lid_pegs(AT, MoldOptions())):
        sizes = [4.0 * THIN, 4.0, 4.0, 4.0]
        for peg, d in zip(found.pegs, sizes, strict=True):
            tip = LEAD_IN * d
            r, end = d / 2.0, 0.35 * d
            wanted = math.pi * (r**2 * (4.0 - tip) + tip / 3.0 * (r**2 + r * end + end**2))
            assert peg.volume == pytest.approx(wanted, rel=1e-9)


def test_pins_reach_through_the_carrier_as_far_as_pegs() -> None:
    o = MoldOptions(carrier=True)
    found = carrier_pins(AT, o)
    assert len(found.parts) == 4
    for pin in found.parts.values():
        box = pin.bounding_box()
        assert box.max.Y == pytest.approx(o.peg_mm)
        assert box.min.Y == pytest.approx(-o.carrier_mm - 2.0 * o.rim_mm)
    assert len(found.cut["lid"]) == len(found.cut["half_a"]) == 4


@pytest.mark.parametrize("printer", ["fdm-0.4", "sla"])
def test_the_holes_have_the_clearances_that_are_told(printer) -> None:
    o = MoldOptions(printer=printer)
    parts = coupon(o)
    radii = sorted(face.radius for face in parts["coupon_holes"].faces() if face.radius)
    assert radii == pytest.approx([2.0 + gap for gap in coupon_clearances(o)])
    assert max(face.radius for face in parts["coupon_peg"].faces() if face.geom_type.name == "CYLINDER") == 2.0
    for name, part in parts.items():
        seen = check_print(shell(part, 0.05, name).surface, 0.5)
        assert (seen.defect, len(seen.islands)) == ("", 0)
        assert seen.wall_mm >= 0.97 * o.machine.thinnest_mm


def test_holes_are_numbered_by_notches() -> None:
    """1 + 2 + ... + 6 notches: three faces each beyond those of a bar with six blind holes."""
    assert len(coupon(MoldOptions())["coupon_holes"].faces()) == 6 + 12 + 3 * 21 + 21
