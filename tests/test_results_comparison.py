"""Cases of a comparison."""

from __future__ import annotations

import json

import pytest

from finger3d.errors import Outcome
from finger3d.results.comparison import FORCE, Case


@pytest.mark.parametrize(
    ("model", "section"),
    [("plane stress", True), ("plane strain", True), ("solid", False), ("solid, ends held", False)],
)
def test_a_case_is_written_as_json(model: str, section: bool) -> None:
    case = Case(model, 20.0, 1.5, "swept", Outcome.CONVERGED, {FORCE: 3.25}, {FORCE: 0.01}, {"z = 0": {"x_mm": [0.0]}})
    assert case.is_section is section
    assert case.ok
    told = json.loads(json.dumps(case.as_dict()))
    assert (told["model"], told["width_mm"], told["outcome"]) == (model, 20.0, "converged")
    assert told["numbers"][FORCE] == 3.25
    assert told["errors"][FORCE] == 0.01


def test_a_case_that_failed_says_why() -> None:
    case = Case("solid", 20.0, 1.5, "swept", Outcome.NO_CONVERGENCE)
    assert not case.ok
    assert case.as_dict()["outcome"] == str(Outcome.NO_CONVERGENCE)
