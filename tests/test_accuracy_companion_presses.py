"""Presses of companions, alone and beside the press that they are companions of."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.accuracy.companion_presses import CompanionThread, companion_presses
from finger3d.accuracy.estimate import main_numbers
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Leg
from finger3d.progress import QUIET
from tests.models import half_cylinder, run


def large(size: float) -> Problem:
    return run(LargeDeformation().apply(half_cylinder(size, steps=3)))[0]


def test_there_are_three_with_longer_edges_in_the_same_increments() -> None:
    found = companion_presses(run(half_cylinder(0.08))[0])
    assert [one.ratio for one in found] == pytest.approx([2.0, 2.0**0.5, 4.0], rel=0.01)
    assert all(one.end.outcome.ok and one.end.target.depth_mm == 1.0 for one in found)


def test_those_pressed_beside_the_press_are_the_same() -> None:
    problem = large(0.3)
    alone = companion_presses(problem)
    with CompanionThread() as thread:
        thread.begin(problem)
        run(problem.model)
        beside = thread.of(problem, None, QUIET)
    assert len(alone) == len(beside) > 1
    for one, other in zip(alone, beside, strict=True):
        assert main_numbers(*one[1:]) == pytest.approx(main_numbers(*other[1:]), rel=1e-12)


def test_those_of_another_mesh_are_pressed_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = large(0.4), large(0.3)
    with CompanionThread() as thread:
        thread.begin(first)
        found = thread.of(second, None, QUIET)
    assert found[0].problem.model.mesh.size_mm == pytest.approx(0.15)  # of few unknowns: finer


def test_an_interruption_ends_them() -> None:
    problem = large(0.1)
    many = replace(problem, model=replace(problem.model, legs=(Leg(1.0, steps=400),)))

    def interrupted() -> None:
        with CompanionThread() as thread:
            thread.begin(many)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):  # and the thread does not go on through 400 increments
        interrupted()
