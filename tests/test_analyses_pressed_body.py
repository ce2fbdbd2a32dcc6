"""Pressed bodies: presses with several coefficients of friction, and bodies that have to be condensed again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from finger3d.analyses import pressed_body as pressing
from finger3d.analyses.calibrate import run as runs
from finger3d.contact import acceleration
from finger3d.contact.conditions import ContactProblem
from finger3d.errors import UnresolvedError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Leg
from tests.logs import Log
from tests.sensor_cases import scene


def test_presses_started_from_their_neighbours_end_where_cold_ones_do(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = {"size_mm": 6.0, "base_size_mm": 14.0, "mesher": "swept"}
    problem = build(scene(model={"domain": "solid"}, mesh=sizes).model())
    replaced: list[bool] = []  # for every increment, whether its initial guess differs from the expected forces
    warm_start = acceleration.warm_start

    def counted(problem: ContactProblem, expected: Any) -> Any:
        guess = warm_start(problem, expected)
        replaced.append(guess is not expected)
        return guess

    monkeypatch.setattr(acceleration, "warm_start", counted)
    cold = {mu: pressing.press(problem, mu) for mu in runs.MUS}
    alone = sum(replaced)
    assert alone == len(replaced) == 6 * len(runs.MUS)  # each of four increments, the first in three parts
    chain = list(pressing.presses(problem, runs.MUS))
    unguided = 2 * len(runs.MUS)  # the first parts, at whose ends the neighbours have no forces
    assert sum(replaced) - alone - unguided < 0.5 * alone  # forces of a neighbour touch where they should
    again = list(pressing.presses(problem, runs.MUS[::6], cold))  # each from the same press
    for found in (*chain, *again):
        assert found.frame.outcome.ok
        assert found.frame.gauges["g36"] == pytest.approx(cold[found.mu].frame.gauges["g36"], rel=1e-9)
    assert [p.frame.iterations for p in again] == [0] * len(again)  # nothing is left to solve
    far = list(pressing.presses(problem, (0.06, 0.5, 1.0)))  # forces at half the friction would be no help
    assert [p.frame.iterations for p in far] == [pressing.press(problem, p.mu).frame.iterations for p in far]


NARROW = -0.8
"""Margin with which only points deep inside the object are candidates."""


def test_all_presses_are_of_the_body_that_is_wide_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    model, mus = scene(model={"domain": "plane-strain"}, mesh={"size_mm": 2.0, "base_size_mm": 8.0}).model(), (0.1, 0.6)
    wide, said = pressing.PressedBody(model), Log()
    ends, steps = wide.ends(mus), wide.steps()
    monkeypatch.setattr(pressing, "build", lambda m, report, margin=NARROW: build(m, report, margin))
    narrow = pressing.PressedBody(model, said)
    few = len(narrow.problem.surface.nodes)
    again = narrow.ends(mus)
    count = len(narrow.problem.surface.nodes)
    assert sum("beyond" in line for line in said.lines) == 1
    assert few < len(wide.problem.surface.nodes) <= count
    for one, other in zip(again, ends, strict=True):
        assert one.meshed_state.contact.force.shape == (count, 2)
        assert one.gauges == pytest.approx(other.gauges, rel=1e-9)
        assert one.penetration_mm == pytest.approx(other.penetration_mm, rel=1e-9)
    (last,) = (one[-1] for one in [narrow.steps()])
    assert last.gauges == pytest.approx(steps[-1].gauges, rel=1e-9)
    assert sum("beyond" in line for line in said.lines) == 1


def test_a_body_under_a_force_is_meshed_for_the_depth_that_it_is_reached_at() -> None:
    legs = (Leg(0.2, steps=2, force_N=8.0),)  # a forecast that is far too small
    model = replace(
        scene(model={"domain": "plane-strain"}, mesh={"size_mm": 2.0, "base_size_mm": 8.0}).model(), legs=legs
    )
    said = Log()
    body = pressing.PressedBody(model, said)
    last = body.steps()[-1]
    assert sum("deeper" in line for line in said.lines) == 1
    # the depth reached on the first mesh, from that on the mesh for it
    assert body.problem.model.legs[0].depth_mm == pytest.approx(last.target.depth_mm, rel=0.01)
    assert -float(last.state.force[:, 0].sum()) == pytest.approx(-8.0, rel=1e-6)


def test_another_path_is_refused_where_the_object_passes_between_the_points() -> None:
    model = scene(
        model={"domain": "plane-strain"}, mesh={"size_mm": 4.0, "base_size_mm": 16.0}, press={"depth_mm": 5.0},
        object={"shape": "wedge", "angle_deg": 60.0, "tip_radius_mm": 0.5},
    ).model()  # fmt: skip
    problem = build(model)
    assert pressing.under(problem, model.friction.with_mu(0.9)).model.friction.mu == 0.9
    assert pressing.under(problem).model == model
    with pytest.raises(UnresolvedError):
        pressing.under(problem, legs=(Leg(0.05),))
