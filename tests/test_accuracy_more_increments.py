"""The change by more increments, estimated beside a press."""

from __future__ import annotations

from dataclasses import replace

from finger3d.accuracy.changes import changing_numbers
from finger3d.accuracy.more_increments import may_matter, more_increments
from finger3d.contact.friction import Coulomb
from tests.models import ended, half_cylinder

COARSE = 0.3


def test_the_change_by_more_increments_is_that_of_many() -> None:
    model = replace(half_cylinder(COARSE, 5), friction=Coulomb(0.5))
    problem, step = ended(model)
    estimate = more_increments(problem, step, 5)
    many = changing_numbers(*ended(replace(model, legs=tuple(replace(leg, steps=640) for leg in model.legs))))
    assert estimate.significant
    for name, change in estimate.significant.items():
        assert 1.0 / 1.5 <= (many[name] - change.value) / change.change <= 1.5
    auto = replace(problem, model=replace(model, legs=tuple(replace(leg, steps="auto") for leg in model.legs)))
    none = more_increments(auto, step, 5)
    assert none.changes == {}
    assert "error" in none.method  # by which these increments were chosen


def test_more_increments_may_matter_from_a_hundredth() -> None:
    numbers = {"normal_force_N": 10.0, "gauge_a": 0.1, "gauge_b": 0.001}
    assert may_matter(numbers, {"normal_force_N": 0.11})
    assert may_matter(numbers, {"gauge_a": 0.0011})
    assert not may_matter(numbers, {"normal_force_N": 0.09, "gauge_b": 0.0009})  # of the largest strain
    assert not may_matter(numbers, {})
