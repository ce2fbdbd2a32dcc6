"""Evaluations as lines of a file."""

from __future__ import annotations

import json
import math

import pytest

from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.optimise.evaluation import Evaluation, evaluation_of, row_check
from finger3d.analyses.optimise.task import OptimisationProblem

CHECK = row_check(OptimisationProblem({}, (FreeKey("a", 0.0, 1.0), FreeKey("b", 0.0, 1.0))))


def test_an_evaluation_comes_back_from_its_line() -> None:
    row = json.loads('{"values": [0.25, 0.5], "objective": NaN, "outcome": "too deep"}')
    assert CHECK(row) == ""
    found = evaluation_of(row)
    assert (found.values, found.outcome) == ((0.25, 0.5), "too deep")
    assert math.isnan(found.value)
    assert evaluation_of({**row, "objective": 3.5}) == Evaluation((0.25, 0.5), 3.5, "too deep")


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ([1.0], "JSON"),
        ({"values": [0.5], "objective": 1.0, "outcome": "converged"}, "values"),
        ({"values": [0.5, "a"], "objective": 1.0, "outcome": "converged"}, "numbers"),
        ({"values": [0.5, 0.5], "objective": None, "outcome": "converged"}, "numbers"),
        ({"values": [0.5, 0.5], "objective": 1.0}, "outcome"),
    ],
)
def test_a_line_of_another_kind_is_told(row: object, said: str) -> None:
    assert said in CHECK(row)
