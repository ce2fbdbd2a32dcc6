"""Slots of gauges' strips, and their plugs."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mold.foils import PLUG_MM, strips
from tests.mold_cases import GAUGES


def test_every_slot_is_at_its_gauges_place_and_angle(paper_mold) -> None:
    """The strip's section: centre times the scale, the foil with its gaps along the gauge and across."""
    assert len(paper_mold.slots) == 2  # two gauges share a strip
    for slot, gauge, length in zip(paper_mold.slots, GAUGES, (5.0, 4.0), strict=False):
        np.testing.assert_allclose([*slot.center()][:2], gauge.middle[:2] / 0.99, rtol=1e-9)
        corners = np.array([[*v] for v in slot.vertices()]) - [*slot.center()]
        across = np.array([-gauge.direction[1], gauge.direction[0], 0.0])
        assert np.ptp(corners @ gauge.direction) == pytest.approx(length + 0.3, rel=1e-9)
        assert np.ptp(corners @ across) == pytest.approx(0.1 + 0.3, rel=1e-9)
    # and it is open through walls and plugs: nothing of any part is left in it
    for slot in paper_mold.slots:
        for part in paper_mold.parts.values():
            shared = slot & part
            assert shared is None or sum(s.volume for s in shared.solids()) == pytest.approx(0.0, abs=1e-9)


def test_a_plug_fills_its_pocket_but_for_clearance_and_slit(paper_mold) -> None:
    """Section of the pocket in the outer wall against that of the plug: gaps of 0.2 mm around, a slit of 0.4 mm."""
    o = paper_mold.options
    for i, length in ((1, 5.3), (2, 4.3)):
        pocket = np.array([length, 0.4]) + 4.0 * o.rim_mm
        block = pocket - 2.0 * o.gap_mm
        # from the far end of the strip out of the near end of the plug
        slit = 0.4 * (0.5 * block[0] + 0.5 * length)
        plug = paper_mold.parts[f"plug_{i}a"]
        height = plug.bounding_box().size.Z
        assert plug.volume == pytest.approx((block.prod() - slit) * height, rel=1e-6)
        outside = height - PLUG_MM
        assert plug.bounding_box().max.Z - paper_mold.layout.outer_high[2] == pytest.approx(outside, rel=1e-6)


def test_strips_for_the_picture_reach_out_of_the_mold(paper_mold) -> None:
    found = strips(paper_mold.foils, paper_mold.layout, paper_mold.options)
    assert found.high[2] > paper_mold.layout.outer_high[2]
    assert strips((), paper_mold.layout, paper_mold.options) is None
