"""Equations of an increment at finite strain: balanced where the increment has been solved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.tensors import InvertedError
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.finite_strain.formulation import FiniteStrain
from finger3d.mechanics.finite_strain.increment import FiniteIncrement
from finger3d.mechanics.finite_strain.state import DeformedBody
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.model import ElasticObject, Leg, MeshOptions, Model
from finger3d.mechanics.path import targets
from finger3d.mechanics.results.state import State
from finger3d.objects import Cylinder, Move
from tests.models import half_cylinder


def solved_increment(model: Model) -> tuple[FiniteIncrement, State[DeformedBody]]:
    problem = build(LargeDeformation().apply(model))
    formulation = formulation_of(problem.model)
    assert isinstance(formulation, FiniteStrain)
    rest, pose = formulation.start(problem), targets(problem.model.legs)[0]
    increment = formulation.equations(problem, rest, Move(problem.origin, pose), formulation.workspace())
    state = increment.solve(None).state
    return increment, state


@pytest.fixture(scope="module")
def solved() -> tuple[FiniteIncrement, State[DeformedBody]]:
    return solved_increment(half_cylinder(1.0))


def test_a_solution_is_in_balance_and_a_displaced_one_is_not(
    solved: tuple[FiniteIncrement, State[DeformedBody]],
) -> None:
    increment, state = solved
    force = np.abs(state.contact.force).max()
    free = np.setdiff1d(np.arange(len(state.body.unknowns)), increment.problem.body.fixed_dofs)
    at_rest, displaced = (
        np.abs(increment.out_of_balance(increment.at(share * state.body.unknowns), state.contact.force)[free]).max()
        for share in (1.0, 1.001)
    )
    assert at_rest < 1e-7 * force
    assert displaced > 1e-4 * force


def test_the_tangent_is_the_derivative_of_the_forces_out_of_balance(
    solved: tuple[FiniteIncrement, State[DeformedBody]],
) -> None:
    """One chord step from nearby leads back to the solution, up to the square of the distance."""
    increment, state = solved
    now = increment.at(1.001 * state.body.unknowns)
    linearisation = increment.linearise(now, state.contact.force)
    out = increment.out_of_balance(now, state.contact.force)
    eliminated = linearisation.condensation.eliminated(-out)
    _, found, change = increment.contact(now, state.contact.force, linearisation, eliminated.displacement)
    assert found.outcome.ok
    assert change is not None
    after, _ = increment.moved(now, eliminated.unknowns(change), found.state.force)
    size = np.abs(state.body.unknowns).max()
    assert np.abs(after.x - state.body.unknowns).max() < 0.02 * 0.001 * size


def test_beside_an_elastic_object_the_tangent_contains_the_turn_of_the_common_normal() -> None:
    """One chord step from nearby leads back but for a few percent; without the turn more than a fifth is left."""
    finger = designs()["block"](half_length_mm=4.0, height_mm=4.0, width_mm=4.0)
    model = Model(
        finger, Isotropic(1.0, 0.45), MeshOptions(0.5, 1.0, "swept"), (Leg(1.0, steps=1),), friction=Coulomb(0.25),
        domain="plane-strain", object_compliance=ElasticObject(2.0, 0.4, 6.0),
    )  # fmt: skip
    increment, state = solved_increment(model)
    force, x = state.contact.force, state.body.unknowns
    away = np.random.default_rng(1).uniform(-1e-6, 1e-6, len(x))
    away[increment.problem.body.fixed_dofs] = 0.0
    now, left = increment.at(x + away), []
    for turns in (now.contact.turns, np.zeros_like(now.contact.turns)):
        there = replace(now, contact=replace(now.contact, turns=turns))
        linearisation = increment.linearise(there, force)
        eliminated = linearisation.condensation.eliminated(-increment.out_of_balance(now, force))
        read = eliminated.displacement[linearisation.reads]
        _, found, change = increment.contact(now, force, linearisation, read)
        assert found.outcome.ok
        nodes = increment.problem.mesh.points.size
        left.append(np.abs(away + eliminated.unknowns(change))[:nodes].max() / np.abs(away).max())
    assert left[0] < 0.05
    assert left[1] > 0.2


def test_nodal_forces_turn_with_a_curved_object_as_it_is_lowered() -> None:
    """The change is that of a body which rises, and the object's normals differ from sample to sample."""
    increment, state = solved_increment(replace(half_cylinder(1.0), object=Cylinder(radius_mm=6.0)))
    force, x = state.contact.force.copy(), state.body.unknowns
    force[:, 1:] = 0.0  # directions of friction do not turn in the tangent
    turning, h = increment.linearise(increment.at(x), force, local=True).turning, 1e-4
    assert turning is not None
    ends, (start, end) = [], (increment.move.start, increment.move.end)
    for sign in (1.0, -1.0):
        lower = replace(increment, move=Move(start, replace(end, depth_mm=end.depth_mm + sign * h)))
        there = lower.at(x).contact
        ends.append(there.nodal_forces(force * (there.slope / increment.at(x).contact.slope)[:, None]))
    slope = (ends[0] - ends[1]).ravel() / (2.0 * h)
    assert np.abs(slope).max() > 0.01 * np.abs(force).max() / 6.0
    rises = np.broadcast_to(np.eye(2)[1], (slope.size // 2, 2)).ravel()
    assert turning @ rises == pytest.approx(slope, rel=1e-4, abs=1e-4 * np.abs(slope).max())


def test_a_step_that_passes_the_least_energy_by_far_is_halved(
    solved: tuple[FiniteIncrement, State[DeformedBody]],
) -> None:
    """Near a solution the energy is a parabola: at twice the way to its minimum it rises as steeply as it falls."""
    increment, state = solved
    x, force = state.body.unknowns, state.contact.force
    now = increment.at(0.999 * x)
    for factor, halved in ((1.9, 1.0), (2.2, 0.5), (3.9, 0.5), (4.2, 0.25)):
        after, _ = increment.moved(now, factor * 0.001 * x, force)
        assert after.x == pytest.approx((0.999 + halved * factor * 0.001) * x, rel=1e-9)


def test_a_long_step_up_in_energy_is_reversed(solved: tuple[FiniteIncrement, State[DeformedBody]]) -> None:
    increment, state = solved
    x, force = state.body.unknowns, state.contact.force
    now, largest = increment.at(0.5 * x), increment._largest_step / np.abs(x).max()
    up, down = (increment.moved(now, sign * 1.01 * largest * x, force)[0] for sign in (-1.0, 1.0))
    assert up.x == pytest.approx(down.x, rel=1e-9)
    assert up.x @ x > now.x @ x
    short, _ = increment.moved(now, -0.1 * largest * x, force)
    assert short.x == pytest.approx((0.5 - 0.1 * largest) * x, rel=1e-9)


def test_an_inverted_cell_is_an_error(solved: tuple[FiniteIncrement, State[DeformedBody]]) -> None:
    increment, state = solved
    with pytest.raises(InvertedError):
        increment.at(np.random.default_rng(0).normal(size=len(state.body.unknowns)))
