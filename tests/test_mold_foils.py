"""Slots of gauges' strips."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mold.foils import slot, strips
from finger3d.mold.solids import common
from tests.mold_cases import GAUGES


def test_every_slot_is_at_its_gauges_place_and_angle(paper_mold) -> None:
    """The strip's section: centre times the scale, the foil with its gaps along the gauge and across."""
    slots = [slot(foil, paper_mold.layout, paper_mold.options) for foil in paper_mold.foils]
    assert len(slots) == 2  # two gauges share a strip
    for found, gauge, length in zip(slots, GAUGES, (5.0, 4.0), strict=False):
        np.testing.assert_allclose([*found.center()][:2], gauge.middle[:2] / 0.99, rtol=1e-9)
        corners = np.array([[*v] for v in found.vertices()]) - [*found.center()]
        across = np.array([-gauge.direction[1], gauge.direction[0], 0.0])
        assert np.ptp(corners @ gauge.direction) == pytest.approx(length + 0.3, rel=1e-9)
        assert np.ptp(corners @ across) == pytest.approx(0.1 + 0.3, rel=1e-9)
        # and it is open through the walls: nothing of any part is left in it
        assert all(common(found, part) == pytest.approx(0.0, abs=1e-9) for part in paper_mold.parts.values())


def test_strips_for_the_picture_reach_out_of_the_mold(paper_mold) -> None:
    found = strips(paper_mold.foils, paper_mold.layout, paper_mold.options)
    assert found.high[2] > paper_mold.layout.outer_high[2]
    assert strips((), paper_mold.layout, paper_mold.options) is None
