"""Changes of the numbers of a press: whether they are significant, and the scales relative to which they count."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.accuracy.changes import Change, ChangeEstimate, natural_scales
from finger3d.contact.friction import Coulomb
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.readings.reading import Marker, Taxel
from tests.models import half_cylinder


def test_a_change_is_significant_if_its_interval_is_narrow_and_the_change_large() -> None:
    found = Change(10.0, 3.0, 0.9, 10.0)
    assert found.significant
    assert (found.low, found.high) == (2.1, 3.9)
    # within a third of an estimate d lies what is within a factor of 1.5 of it: 2/3 d to 4/3 d
    assert found.low > 3.0 / 1.5
    assert not Change(10.0, 3.0, 1.1, 10.0).significant
    assert not Change(0.1, 0.0009, 1e-5, 0.1).significant  # less than a hundredth of the scale
    assert not Change(0.0, 0.0, 0.0, 0.0).significant


def test_the_interval_holds_how_far_the_coarse_press_is_from_the_press() -> None:
    coarse = ChangeEstimate(
        changes={"normal_force_N": Change(10.0, 1.0, 0.1, 10.0), "other": Change(1.0, 0.0, 0.0, 1.0)}
    )
    (found,) = coarse.of_press({"normal_force_N": 10.5}).changes.values()
    assert (found.value, found.change, found.error) == (10.5, 1.0, 0.5)


def test_a_number_counts_relative_to_what_it_is_a_part_of() -> None:
    model = replace(
        half_cylinder(0.3), friction=Coulomb(0.25), gauges=(Gauge("a", 1.0, 4.0), Gauge("b", 1.0, 3.0)),
        markers=(Marker("m", 0.0, 4.0, 0.0),), taxels=(Taxel("t", 0.0, 0.0, 1.0, 1.0),),
    )  # fmt: skip
    design = model.design
    numbers = {
        "normal_force_N": 8.0, "friction_sum_N": 0.1, "contact_half_length_mm": 2.0, "stick_half_length_mm": 0.1,
        "contact_area_mm2": 5.0, "stick_area_mm2": 0.0, "gauge_a": -0.01, "gauge_b": 1e-4, "marker_m_x_mm": 1e-3,
        "taxel_t_MPa": 1e-3,
    }  # fmt: skip
    base = 2.0 * design.half_length_mm * design.width_mm
    assert natural_scales(model, 0.5, numbers) == pytest.approx(
        {
            "normal_force_N": 8.0, "friction_sum_N": 0.25 * 8.0, "contact_half_length_mm": 2.0,
            "stick_half_length_mm": 2.0, "contact_area_mm2": 5.0, "stick_area_mm2": 5.0,
            "gauge_a": 0.5 / design.height_mm, "gauge_b": 0.5 / design.height_mm, "marker_m_x_mm": 0.5,
            "taxel_t_MPa": 8.0 / base,
        }
    )  # fmt: skip
    assert natural_scales(model, 0.5, {**numbers, "gauge_a": 0.3})["gauge_b"] == 0.3
