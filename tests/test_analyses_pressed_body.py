"""Presses at the values of mu of a calibration."""

from __future__ import annotations

from typing import Any

import pytest

from finger3d.analyses import pressed_body as pressing
from finger3d.analyses.calibrate import run as runs
from finger3d.contact import acceleration
from finger3d.contact.conditions import ContactProblem
from finger3d.mechanics.build import build
from tests.sensor_cases import scene


@pytest.mark.parametrize(
    ("domain", "mesh"), [("plane-strain", (1.0, 6.0)), ("solid", (6.0, 14.0))], ids=["section", "solid"]
)
def test_presses_started_from_their_neighbours_end_where_cold_ones_do(
    monkeypatch: pytest.MonkeyPatch, domain: str, mesh: tuple[float, float]
) -> None:
    sizes = {"size_mm": mesh[0], "base_size_mm": mesh[1], "mesher": "swept"}
    problem = build(scene(model={"domain": domain}, mesh=sizes).model())
    replaced: list[bool] = []  # for every increment, whether its initial guess differs from the expected forces
    warm_start = acceleration.warm_start

    def counted(problem: ContactProblem, expected: Any) -> Any:
        guess = warm_start(problem, expected)
        replaced.append(guess is not expected)
        return guess

    monkeypatch.setattr(acceleration, "warm_start", counted)
    cold = {mu: pressing.press(problem, mu) for mu in runs.MUS}
    alone = sum(replaced)
    assert alone == len(replaced) == 4 * len(runs.MUS)  # each of four increments
    chain = list(pressing.presses(problem, runs.MUS))
    assert sum(replaced) - alone < 0.5 * alone  # forces of a neighbour touch where they should
    again = list(pressing.presses(problem, runs.MUS[::6], cold))  # each from the same press
    for found in (*chain, *again):
        assert found.frame.outcome.ok
        assert found.frame.gauges["g36"] == pytest.approx(cold[found.mu].frame.gauges["g36"], rel=1e-9)
    assert [p.frame.iterations for p in again] == [1] * len(again)
    far = list(pressing.presses(problem, (0.06, 0.5, 1.0)))  # forces at half the friction would be no help
    assert [p.frame.iterations for p in far] == [pressing.press(problem, p.mu).frame.iterations for p in far]
