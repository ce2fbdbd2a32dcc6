"""Screws, bands and pry notches."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.mold.fasteners import band_grooves, bolts, cover_groove_mm, pry_notches, screws
from finger3d.mold.layout import layout_of
from finger3d.mold.options import MoldOptions

LOW, HIGH = np.array([-20.0, 0.0, -10.0]), np.array([20.0, 30.0, 10.0])


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
