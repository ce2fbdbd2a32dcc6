"""Increments to a prescribed normal force at finite strain, with the depth as an unknown of the iteration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.finite_strain.formulation import FiniteStrain
from finger3d.mechanics.march.solve import Press, march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.results.history import measure
from finger3d.objects import Move, ObjectPose
from tests.models import large_fig9, run

DEPTHS = (4.0, 6.0)


def test_the_depth_is_that_at_which_a_given_depth_has_the_force() -> None:
    problem, frames = run(large_fig9(0.45, 4.0, legs=tuple(Leg(depth, steps=1) for depth in DEPTHS)))
    wanted = measure(problem.points, frames[1])["normal_force_N"]
    formulation = Press(problem).formulation
    assert isinstance(formulation, FiniteStrain)
    state = frames[0].meshed_state
    # it begins half a millimetre off
    move = Move(ObjectPose(DEPTHS[0]), ObjectPose(DEPTHS[1] + 0.5))
    found = formulation.end_at_force(problem, (state, None), move, wanted, formulation.workspace())
    assert found is not None
    # residuals of 5e-9 of both presses
    assert found.depth_mm == pytest.approx(DEPTHS[1], rel=1e-6)
    assert found.state.body.unknowns == pytest.approx(frames[1].meshed_state.body.unknowns, abs=1e-5)
    near = [measure(problem.points, f)["normal_force_N"] for f in march(_to(problem, DEPTHS[1] + 1e-3))][-1]
    # the rate is that of the tangent before the last iteration
    assert found.rate == pytest.approx((near - wanted) / 1e-3, rel=0.05)


def _to(problem: Problem, depth: float) -> Problem:
    legs = (Leg(DEPTHS[0], steps=1), Leg(depth, steps=1))
    return replace(problem, model=replace(problem.model, legs=legs))


def test_without_contact_there_is_no_end() -> None:
    problem = build(large_fig9(0.45, 4.0))
    formulation = Press(problem).formulation
    assert isinstance(formulation, FiniteStrain)
    start, move = (formulation.start(problem), None), Move(ObjectPose(0.0), ObjectPose(-1.0))
    assert formulation.end_at_force(problem, start, move, 1.0, formulation.workspace()) is None


def test_a_press_to_a_force_takes_at_most_twice_the_tangents_of_given_depths() -> None:
    model = large_fig9(0.45, 4.0, legs=(Leg(8.0, steps=6, force_N=100.0),))
    problem, frames = run(model)
    by_force = _factors(problem)
    depths = tuple(Leg(frame.target.depth_mm, steps=1) for frame in frames)
    by_depth = _factors(replace(problem, model=replace(model, legs=depths)))
    assert np.allclose([measure(problem.points, f)["normal_force_N"] for f in frames], np.linspace(100 / 6, 100, 6))
    assert by_force <= 2 * by_depth


def _factors(problem: Problem) -> int:
    workspace = Press(problem).formulation.workspace()
    assert all(frame.outcome.ok for frame in march(problem, workspace=workspace))
    return int(workspace.factorizations)
