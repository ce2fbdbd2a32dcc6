"""The fit coupon."""

from __future__ import annotations

import pytest

from finger3d.mold.coupon import coupon, coupon_clearances
from finger3d.mold.options import MoldOptions
from finger3d.mold.shell import shell
from finger3d.mold.slicer import check_print


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
