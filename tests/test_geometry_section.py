"""Sections of fingers."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from finger3d.geometry.section import (
    Core,
    Section,
    block_section,
    cylinder_section,
    largest_core_mm,
    largest_layer_mm,
    with_core,
    with_layer,
)
from tests.designs import make


def test_the_papers_finger_is_50_mm_high() -> None:
    # Maeno 2004, Sec. III: 36.6 = 50 - (100 - sqrt(100^2 - 50^2)), to the digits the paper gives.
    assert make("clipped_cylinder").height_mm == pytest.approx(50.0, abs=0.003)


def test_a_clipped_cylinder_without_clipping_is_the_half_cylinder() -> None:
    clipped = make("clipped_cylinder", radius_mm=5.0, half_length_mm=5.0, edge_height_mm=0.0, width_mm=10.0)
    half = make("half_cylinder")
    assert clipped.volume_mm3 == half.volume_mm3 == pytest.approx(0.5 * math.pi * 250.0, rel=1e-15)
    assert clipped.height_mm == half.height_mm
    x, z = np.linspace(-6, 6, 25), np.zeros(25)
    np.testing.assert_array_equal(clipped.top(x, z), half.top(x, z))


def test_a_skin_is_the_ring_between_concentric_arcs() -> None:
    # between half circles of radii 5 and 4
    round_ = with_layer(cylinder_section(5.0, 5.0, 0.0), 1.0)
    assert round_.areas_mm2["skin"] == pytest.approx(0.5 * math.pi * (25.0 - 16.0))
    assert round_.inner.half_length_mm == 4.0
    x = np.linspace(0.0, 45.0, 7)
    fig9 = with_layer(cylinder_section(100.0, 50.0, 36.6), 3.0)
    # along the radius the arcs are 3 mm apart
    outer = np.hypot(x, fig9.contact.height(x) - fig9.inner.contact.centre_y_mm)
    inner = np.hypot(x, fig9.inner.contact.height(x) - fig9.inner.contact.centre_y_mm)
    np.testing.assert_allclose(outer - inner, 3.0, rtol=1e-12)
    assert fig9.inner.half_length_mm == 50.0
    assert fig9.inner.edge_height_mm == pytest.approx(float(fig9.inner.contact.height(np.array(50.0))))


def test_areas_of_parts_sum_up_to_the_section() -> None:
    section = with_core(with_layer(block_section(20.0, 15.0), 2.0), Core(5.0, 10.0))
    assert section.part_labels == ("skin", "core")
    assert section.areas_mm2 == {"": 40.0 * 13.0 - 100.0, "skin": 80.0, "core": 100.0}
    assert sum(section.areas_mm2.values()) == section.area_mm2


def test_parts_that_do_not_fit_raise() -> None:
    fig9 = cylinder_section(100.0, 50.0, 36.6)
    thick, core = largest_layer_mm(fig9), Core(10.0, largest_core_mm(fig9, 10.0))
    with pytest.raises(ValueError, match=f" {thick} mm "):
        with_layer(fig9, thick)
    with pytest.raises(ValueError, match=re.escape(str(core))):
        with_core(fig9, core)
    assert largest_core_mm(fig9, 50.0) == pytest.approx(36.6)
    assert largest_layer_mm(block_section(3.0, 2.0)) == 2.0


@pytest.mark.parametrize("section", [cylinder_section(100.0, 50.0, 36.6), block_section(20.0, 15.0)])
def test_fractions_are_the_inverse_of_points(section: Section) -> None:
    u = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(section.contact.fraction(section.contact.at(u)[:, 0]), u, atol=1e-14)
