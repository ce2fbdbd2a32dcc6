"""What is optimised: the objective and its problem."""

from __future__ import annotations

import json
import math

import pytest

from finger3d.analyses.optimise.task import Evaluation, evaluation_of, sensitivity
from tests.sensor_cases import objective_table

MUS = (0.1, 0.5, 1.0)


def test_sensitivity_is_the_least_slope_in_units_of_noise() -> None:
    # slopes 0.1/0.4 and 0.05/0.5 per mu, noise 1e-3
    assert sensitivity(objective_table([0.0, 0.1, 0.15])) == pytest.approx(100.0)
    assert sensitivity(objective_table([0.0, -0.1, -0.15])) == pytest.approx(100.0)
    # it turns back: two mu share a strain
    assert sensitivity(objective_table([0.0, 0.1, 0.05])) == pytest.approx(-100.0)


def test_an_evaluation_comes_back_from_its_line() -> None:
    row = json.loads('{"values": [0.25, 0.5], "objective": NaN, "outcome": "too deep"}')
    found = evaluation_of(row)
    assert (found.values, found.outcome) == ((0.25, 0.5), "too deep")
    assert math.isnan(found.value)
    assert evaluation_of({**row, "objective": 3.5}) == Evaluation((0.25, 0.5), 3.5, "too deep")
