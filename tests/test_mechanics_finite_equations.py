"""Equations of an increment at finite strain: balanced where the increment has been solved."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.tensors import InvertedError
from finger3d.mechanics.build import build
from finger3d.mechanics.finite_increment import FiniteIncrement
from finger3d.mechanics.finite_state import DeformedState
from finger3d.mechanics.finite_strain import FiniteStrain
from finger3d.mechanics.path import targets
from tests.models import half_cylinder


@pytest.fixture(scope="module")
def solved() -> tuple[FiniteIncrement, DeformedState]:
    problem = build(LargeDeformation().apply(half_cylinder(1.0)))
    formulation = problem.model.formulation
    assert isinstance(formulation, FiniteStrain)
    rest, pose = formulation.start(problem), targets(problem.model.legs)[0]
    increment = formulation._increment(problem, rest, problem.origin, pose, formulation.workspace())
    state = increment.solve(None).state
    assert isinstance(state, DeformedState)
    return increment, state


def test_a_solution_is_in_balance_and_a_displaced_one_is_not(solved: tuple[FiniteIncrement, DeformedState]) -> None:
    increment, state = solved
    force = np.abs(state.force).max()
    free = np.setdiff1d(np.arange(len(state.unknowns)), increment.problem.body.fixed_dofs)
    at_rest, displaced = (
        np.abs(increment.out_of_balance(increment.at(share * state.unknowns), state.force)[free]).max()
        for share in (1.0, 1.001)
    )
    assert at_rest < 1e-7 * force
    assert displaced > 1e-4 * force


def test_the_tangent_is_the_derivative_of_the_forces_out_of_balance(
    solved: tuple[FiniteIncrement, DeformedState],
) -> None:
    """One chord step from nearby leads back to the solution, up to the square of the distance."""
    increment, state = solved
    now = increment.at(1.001 * state.unknowns)
    linearisation = increment.linearise(now, state.force)
    out = increment.out_of_balance(now, state.force)
    eliminated = linearisation.condensation.eliminated(-out)
    found, change = increment.contact(now, state.force, linearisation, eliminated.displacement)
    assert found.outcome.ok
    assert change is not None
    after = increment.moved(now, eliminated.unknowns(change))
    size = np.abs(state.unknowns).max()
    assert np.abs(after.x - state.unknowns).max() < 0.02 * 0.001 * size


def test_an_inverted_cell_is_an_error(solved: tuple[FiniteIncrement, DeformedState]) -> None:
    increment, state = solved
    with pytest.raises(InvertedError):
        increment.at(np.random.default_rng(0).normal(size=len(state.unknowns)))
