"""Changes of the numbers of a press, and whether they are significant."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.accuracy.changes import check_kind, judged
from finger3d.accuracy.richardson import kinds_of
from finger3d.errors import Finger3dError
from finger3d.mechanics.readings.columns import Column
from finger3d.objects import Plane
from finger3d.scene import load

ZERO = {"normal_force_N": 0.0, "gauge_a": 0.0}


def test_a_change_is_significant_if_its_interval_is_narrow_and_the_change_large() -> None:
    values = {"normal_force_N": 10.0, "friction_sum_N": 4.0, "gauge_a": 0.1, "gauge_b": -0.001, "gauge_c": np.nan}
    changes = {"normal_force_N": 3.0, "friction_sum_N": 0.03, "gauge_a": 0.01, "gauge_b": 0.0009, "gauge_c": 0.1}
    errors = {"normal_force_N": 0.9, "friction_sum_N": 0.001, "gauge_a": 0.004, "gauge_b": 1e-5, "gauge_c": 1e-3}
    kinds = kinds_of(Column(name, "gauge") for name in "abc")
    found = judged(values, changes, errors, kinds)
    # a strain is compared with the largest strain, of which 0.0009 is less than a hundredth
    assert {name: change.significant for name, change in found.items()} == {
        "normal_force_N": True, "friction_sum_N": False, "gauge_a": False, "gauge_b": False,
    }  # fmt: skip
    assert (found["normal_force_N"].low, found["normal_force_N"].high) == (2.1, 3.9)
    # within a third of an estimate d lies what is within a factor of 1.5 of it: 2/3 d to 4/3 d
    assert found["normal_force_N"].low > 3.0 / 1.5
    assert not any(
        change.significant for change in judged({"normal_force_N": 1.0, "gauge_a": 0.0}, ZERO, ZERO, kinds).values()
    )


def test_triangulated_objects_are_not_judged_by_coarse_presses() -> None:
    gear = load(Path(__file__).parents[1] / "geometries" / "gear.toml").model()
    with pytest.raises(Finger3dError, match="triangulated"):
        check_kind(gear)
    check_kind(replace(gear, object=Plane()))
