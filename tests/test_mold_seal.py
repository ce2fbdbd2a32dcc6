"""Seals along the parting faces."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.mold.layout import layout_of
from finger3d.mold.options import TONGUE_HEIGHT_MM, MoldOptions
from finger3d.mold.seal import seal
from tests.bodies import box

BODY = box(40.0, 12.0, 20.0, (0.0, 6.0, 0.0))


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
