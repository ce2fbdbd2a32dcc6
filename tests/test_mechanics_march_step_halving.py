"""Automatic increments end when their estimated error is below the tolerance."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d._cost import PressSize
from finger3d.accuracy.estimate import press_numbers
from finger3d.contact.friction import Coulomb, TwoCoefficients
from finger3d.contact.rules import RULES
from finger3d.errors import Outcome
from finger3d.fem.laws import NeoHooke
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import (
    automatic,
    errors_of_runs,
    increment_error,
    limits,
    march_automatic,
    refine,
    step_error,
)
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.objects import Cylinder, Plane
from tests.models import block, fig9


def test_automatic_increments_end_within_their_estimate() -> None:
    problem = build(fig9(domain="plane-strain", object=Cylinder(radius_mm=80.0), legs=(Leg(10.0, steps="auto"),)))
    seen: list[tuple[int, int]] = []
    *_, (frames, estimate) = refine(problem, advanced=lambda done, total, step: seen.append((done, total)))
    assert seen[:6] == [*((k, 5) for k in range(1, 6)), (1, 10)]
    assert seen[-1] == (len(frames), len(frames))
    assert estimate is not None
    assert estimate.met
    assert max(estimate.normal_force, estimate.friction_sum, estimate.gauges) <= 0.01
    assert estimate.dissipation <= 0.05
    assert [count for count, _ in estimate.runs] == [5 * 2**k for k in range(len(estimate.runs))]
    assert len(estimate.runs) >= 3
    fine = list(march(replace(problem, model=replace(problem.model, legs=(Leg(10.0, steps=4 * len(frames)),)))))
    a, b = measure(problem.points, frames[-1]), measure(problem.points, fine[-1])
    assert a["normal_force_N"] == pytest.approx(b["normal_force_N"], rel=0.01)
    assert a["friction_sum_N"] == pytest.approx(b["friction_sum_N"], rel=0.01)
    assert a["dissipation_mJ"] == pytest.approx(b["dissipation_mJ"], rel=0.05)
    assert a["gauges"]["g36"] == pytest.approx(b["gauges"]["g36"], rel=0.01)


def stuck(**changes: object) -> Model:
    """The Fig. 9 section in plane stress under a bar, at a large coefficient of friction: nearly all of it sticks."""
    model = fig9(
        domain="plane-stress", material=Isotropic(1.0, 0.485), friction=Coulomb(0.988), mesh=MeshOptions(2.9, 11.6),
        object=Cylinder(radius_mm=80.0),
    )  # fmt: skip
    return replace(model, **changes)


def test_errors_of_a_press_that_sticks_are_within_twice_their_estimate() -> None:
    model = stuck()
    problem = build(model)
    told = {}
    for steps in (5, 10, 20, 40, 320):
        trial = replace(problem, model=replace(model, legs=(Leg(10.0, steps=steps),)))
        told[steps] = press_numbers(trial, list(march(trial))[-1])
        if steps < 320:
            bars = step_error(trial, told[steps], press_numbers, 2.0)
            told[steps] |= {f"bar {name}": bar for name, bar in bars.items()}
    for steps in (5, 10, 20, 40):
        for name in ("normal_force_N", "friction_sum_N", "gauge_g36", "external_work_mJ", "dissipation_mJ"):
            assert abs(told[steps][name] - told[320][name]) <= 2.0 * told[steps][f"bar {name}"], (steps, name)


@pytest.mark.parametrize("name", ["rule", "branch"])
def test_rules_that_have_no_limit_in_increments_take_ten(name: str) -> None:
    model = block(legs=(Leg(0.3, steps="auto"),), object=Plane(), friction=Coulomb(0.05))
    literal = {"rule": {"rule": "paper"}, "branch": {"friction": TwoCoefficients(0.1, 0.7, "paper")}}[name]
    assert automatic(model)
    frames, estimate = march_automatic(build(replace(model, **literal)))
    assert estimate is None
    assert len(frames) == 10


def test_a_run_in_few_increments_that_fails_does_not_fail_the_press(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build(block(object=Plane(), legs=(Leg(0.3, steps="auto"),)))
    true_rule = RULES["projection"]

    def timid(contact, guess=None):  # fails from an increment above 0.3 / 8 mm on, so that cutting it does not help
        found = true_rule(contact, guess)
        timid.failed |= bool(np.abs(contact.free_motion[:, 0] - timid.gap).max() > 0.3 / 8)
        if timid.failed:
            return replace(found, state=contact.previous, outcome=Outcome.NO_CONVERGENCE)
        timid.gap = contact.free_motion[:, 0]
        return found

    start = problem.gap(problem.origin)
    timid.gap, timid.failed = start, False
    monkeypatch.setitem(RULES, "projection", timid)
    true_march = march

    def anew(problem: Problem, **arguments: Any):
        timid.gap, timid.failed = start, False
        return true_march(problem, **arguments)

    monkeypatch.setattr("finger3d.mechanics.march.step_halving.march", anew)
    frames, estimate = march_automatic(problem)
    assert frames[-1].outcome.ok
    assert estimate is not None
    assert estimate.runs[0][0] == 10


def test_a_failure_before_the_automatic_legs_is_not_repeated() -> None:
    legs = (Leg(0.2, steps=2, force_N=1e6), Leg(0.1))
    solved = list[StepResult]()
    ((results, estimate),) = refine(
        build(block(legs=legs, domain="plane-strain")), advanced=lambda done, total, step: solved.append(step)
    )
    assert [step.outcome for step in solved] == [step.outcome for step in results] == [Outcome.FORCE_NOT_REACHED]
    assert estimate is None


@pytest.mark.parametrize("ratio", [0.25, 0.5, 2.0])
def test_the_error_is_exact_at_first_order(ratio: float) -> None:
    value, other = (3.0 + 1.0 / n for n in (20.0, 20.0 * ratio))
    assert increment_error(value, other, ratio) == pytest.approx(1.0 / 20.0, rel=1e-9)


def test_two_runs_that_agree_by_chance_do_not_hide_the_error_of_those_before() -> None:
    runs = [(10, {"x": 1.4, "y": 1.0}), (20, {"x": 1.0, "y": 1.3}), (40, {"x": 1.0, "y": 1.0})]
    assert errors_of_runs(runs) == pytest.approx({"x": 0.4 * 0.5**1.5, "y": 0.3})
    assert errors_of_runs(runs[1:]) == pytest.approx({"x": 0.0, "y": 0.3})


@pytest.mark.parametrize("domain", ["solid", "plane-strain"])
def test_most_automatic_increments_fall_with_the_size_of_the_contact(domain: Domain) -> None:
    model = fig9(domain=domain)
    found = [
        limits(model, PressSize(2 if domain == "plane-strain" else 3, 1e4 * points, points))
        for points in (30, 300, 3000)
    ]
    assert all(first == 5 and last >= 20 for first, last in found)
    assert found[0][1] >= found[1][1] >= found[2][1]
    assert limits(replace(model, hyperelastic_law=NeoHooke(1.0)), PressSize(3, 1e4, 100)) == (3, 12)
