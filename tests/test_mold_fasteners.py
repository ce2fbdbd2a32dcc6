"""Pegs and screws."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.mold.fasteners import THIN, bolts, half_pegs, lid_pegs, screws
from finger3d.mold.layout import layout_of
from finger3d.mold.options import SCREWS, MoldOptions
from finger3d.mold.solids import LEAD_IN

LOW, HIGH = np.array([-20.0, 0.0, -10.0]), np.array([20.0, 30.0, 10.0])
AT = layout_of(LOW, HIGH, MoldOptions())


def test_one_peg_is_thin_and_all_have_a_lead_in_and_clearance() -> None:
    """Volume of a cylinder whose tip is a frustum of 0.7 times the diameter, 0.15 diameters high; holes are longer and
    wider by 0.2 mm."""
    for found in (half_pegs(AT, MoldOptions()), lid_pegs(AT, MoldOptions())):
        (made,), holes = found.add.values(), next(iter(found.cut.values()))
        for peg, hole, d in zip(made, holes, [4.0 * THIN, 4.0, 4.0, 4.0], strict=True):
            tip = LEAD_IN * d
            r, end = d / 2.0, 0.35 * d
            wanted = math.pi * (r**2 * (4.0 - tip) + tip / 3.0 * (r**2 + r * end + end**2))
            assert peg.volume == pytest.approx(wanted, rel=1e-9)
            assert hole.volume == pytest.approx(math.pi * (r + 0.2) ** 2 * 4.2, rel=1e-9)


def test_a_screw_of_standard_length_ends_in_its_nut() -> None:
    """The nut lies as deep as the screw reaches: length plus trap, less the nut, is the thickness of the mold."""
    o = MoldOptions()
    found = bolts(AT, o)
    thick = AT.outer_high[2] - AT.outer_low[2]
    assert found.length_mm + found.trap_mm - SCREWS["M3"].nut_mm == pytest.approx(thick)
    assert found.trap_mm >= SCREWS["M3"].nut_mm + 0.2
    cut = screws(AT, o).cut
    holes, traps = cut["half_a"][: found.number], cut["half_a"][found.number :]
    assert all(h.volume == pytest.approx(math.pi * 3.4**2 / 4.0 * thick, rel=1e-6) for h in holes)
    # hexagon: area sqrt(3) / 2 times the width across flats squared; ISO 4032: 5.5 mm
    area = math.sqrt(3.0) / 2.0 * (5.5 + 0.4) ** 2
    assert all(t.volume == pytest.approx(area * found.trap_mm, rel=1e-6) for t in traps)
    assert bolts(AT, MoldOptions(screw="none")) is None
    assert screws(AT, MoldOptions(screw="none")).add == {}
