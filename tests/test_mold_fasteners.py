"""Pegs and pins, seals, screws, bands and pry notches."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.mold.body import shell
from finger3d.mold.fasteners import (
    THIN,
    band_grooves,
    bolts,
    carrier_pins,
    coupon,
    coupon_clearances,
    cover_groove_mm,
    half_pegs,
    lid_pegs,
    pry_notches,
    screws,
    seal,
)
from finger3d.mold.layout import layout_of
from finger3d.mold.options import TONGUE_HEIGHT_MM, MoldOptions
from finger3d.mold.printing import check_print
from finger3d.mold.solids import LEAD_IN
from tests.bodies import box

LOW, HIGH = np.array([-20.0, 0.0, -10.0]), np.array([20.0, 30.0, 10.0])
AT = layout_of(LOW, HIGH, MoldOptions())
BODY = box(40.0, 12.0, 20.0, (0.0, 6.0, 0.0))


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


def _volume(solids) -> float:
    return sum(float(solid.volume) for solid in solids)


def test_the_cord_lies_in_grooves_around_cavity_and_base() -> None:
    """Lengths of the offsets of a rectangle: straight sides, and quarter circles at the corners.

    Circles are polygons of 64 segments, simplified within 0.04 mm: 0.5 % of the area.
    """
    o = MoldOptions(seal="cord")
    width, depth = o.groove_mm
    assert (width, depth) == pytest.approx((2.6, 1.6))
    found = seal([BODY], layout_of(BODY.low, BODY.high, o), o)
    at = o.rim_mm + width / 2.0
    upright, flat = 2 * 12.0 + 40.0 + math.pi * at, 2 * (40.0 + 20.0) + 2.0 * math.pi * at
    assert _volume(found.cut["half_b"]) == pytest.approx(flat * width * depth, rel=5e-3)
    assert _volume(found.cut["half_a"]) == pytest.approx((upright + flat) * width * depth, rel=5e-3)
    assert not found.add


def test_the_tongue_fits_its_groove_with_the_clearance() -> None:
    o = MoldOptions()
    found = seal([BODY], layout_of(BODY.low, BODY.high, o), o)
    for tongue, groove in ((found.add["lid"], found.cut["half_b"]), (found.add["half_b"], found.cut["half_a"][:1])):
        (ridge,), (channel,) = tongue, groove
        assert (ridge - channel).volume == pytest.approx(0.0, abs=1e-6) if (ridge - channel) else True
        assert ridge.distance_to(channel) == 0.0
        sizes = [np.array([*solid.bounding_box().size]) for solid in (ridge, channel)]
        # 0.2 mm of clearance on every side and above; round corners are polygons
        np.testing.assert_array_less(sizes[0], sizes[1])
        assert sorted(sizes[0])[0] == pytest.approx(TONGUE_HEIGHT_MM)
        assert sorted(sizes[1])[0] == pytest.approx(TONGUE_HEIGHT_MM + 0.2)


def test_nothing_stands_on_a_carrier() -> None:
    o = MoldOptions(carrier=True)
    found = seal([BODY], layout_of(BODY.low, BODY.high, o), o)
    assert set(found.add) == {"half_b"}
    assert seal([BODY], layout_of(BODY.low, BODY.high, o), MoldOptions(seal="none")).cut == {}


def test_a_screw_of_standard_length_ends_in_its_nut() -> None:
    """The nut lies as deep as the screw reaches: length plus trap, less the nut, is the thickness of the mold."""
    o = MoldOptions()
    at = layout_of(LOW, HIGH, o)
    found = bolts(at, o)
    thick = at.outer_high[2] - at.outer_low[2]
    assert found.length_mm + found.trap_mm - o.screw_sizes.nut_mm == pytest.approx(thick)
    assert found.trap_mm >= o.screw_sizes.nut_mm + 0.2
    cut = screws(at, o).cut
    holes, traps = cut["half_a"][: found.number], cut["half_a"][found.number :]
    assert all(h.volume == pytest.approx(math.pi * 3.4**2 / 4.0 * thick, rel=1e-6) for h in holes)
    # hexagon: area sqrt(3) / 2 times the width across flats squared; ISO 4032: 5.5 mm
    area = math.sqrt(3.0) / 2.0 * (5.5 + 0.4) ** 2
    assert all(t.volume == pytest.approx(area * found.trap_mm, rel=1e-6) for t in traps)
    assert bolts(at, MoldOptions(fasten="none")) is None
    assert screws(at, MoldOptions(fasten="bands")).add == {}


def test_bands_run_around_halves_and_lid() -> None:
    o = MoldOptions(fasten="bands")
    at = layout_of(LOW, HIGH, o)
    loops, only_lid = band_grooves(at, o), band_grooves(at, MoldOptions())
    assert len(loops.cut["half_a"]) == len(loops.cut["lid"]) + 8  # two loops of four faces
    assert len(only_lid.cut["half_a"]) == len(only_lid.cut["lid"])
    assert band_grooves(at, MoldOptions(fasten="none")).cut == {}
    # the outer face of a carrier is the base of the finger
    assert cover_groove_mm(MoldOptions(carrier=True)) == 0.0
    assert cover_groove_mm(o) == 1.5


def test_notches_are_open_to_the_parting_faces() -> None:
    o = MoldOptions()
    at = layout_of(LOW, HIGH, o)
    found = pry_notches(at, o)
    for notch in found.cut["half_a"]:
        box = notch.bounding_box()
        assert box.min.Z == pytest.approx(at.split)
        assert box.max.Y == pytest.approx(at.top)
    for notch in found.cut["lid"]:
        assert notch.bounding_box().max.Y == pytest.approx(0.0)
    assert pry_notches(at, MoldOptions(pry=False)).cut == {}
