"""Conditions of frictional contact: the projection on the friction cone, and the residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.conditions import ContactProblem, project_on_friction_cone, residual
from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.law import ContactLaw
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.errors import Outcome
from tests.contact_cases import half_plane, random_problem


@pytest.mark.parametrize("dim", [2, 3])
def test_projected_forces_are_admissible_and_projected_on_themselves(dim: int) -> None:
    for seed in range(10):
        problem, force = random_problem(dim, seed)
        projected, status, _ = project_on_friction_cone(problem, force, problem.relative_displacement(force))
        normal, friction = projected[:, 0], np.linalg.norm(projected[:, 1:], axis=1)
        assert (normal >= 0.0).all()
        assert (friction <= problem.friction * normal * (1.0 + 1e-12)).all()
        assert (projected[status == OPEN] == 0.0).all()
        assert np.allclose(friction[status == SLIP], (problem.friction * normal)[status == SLIP])
        again, _, _ = project_on_friction_cone(problem, projected, np.zeros_like(projected))
        assert np.allclose(again, projected, rtol=1e-12)


def test_without_friction_every_closed_point_slips() -> None:
    problem, force = random_problem(3)
    problem = replace(problem, friction=np.zeros(len(force)))
    projected, status, _ = project_on_friction_cone(problem, force, problem.relative_displacement(force))
    assert STICK not in status
    assert (projected[:, 1:] == 0.0).all()


def test_the_projection_and_the_residual_know_the_same_solutions() -> None:
    compliance, gap = half_plane(21, 2, 0.2857, 0.05), np.linspace(-1.0, 1.0, 21) ** 2
    free = np.column_stack([gap - 0.3, np.full(21, -0.01)])
    state = ContactState.at_rest(gap, 2)
    found = solve_increment(ContactProblem.of(state, free, compliance, ContactLaw(Coulomb(0.3)), 1.0)).state
    moved = np.column_stack([found.gap, found.tangential_displacement])
    mu = np.full(21, 0.3)
    assert set(found.status) == {OPEN, STICK, SLIP}
    assert residual(found.force, moved, found.status, mu, 1.0) < 1e-8
    # each condition is measured in its own unit
    i, j = np.flatnonzero(found.status == STICK)[0], np.flatnonzero(found.status == SLIP)[0]
    largest = np.linalg.norm(found.force, axis=1).max()
    deeper = moved - [[0.02, 0.0]] * (found.status != OPEN)[:, None]
    assert residual(found.force, deeper, found.status, mu, 2.0) == pytest.approx(0.01, rel=1e-6)
    slid = moved + 0.03 * np.outer(np.arange(21) == i, [0.0, 1.0])
    assert residual(found.force, slid, found.status, mu, 1.0) == pytest.approx(0.03, rel=1e-6)
    harder = found.force + 0.1 * largest * np.outer(np.arange(21) == j, [0.0, np.sign(found.force[j, 1])])
    assert residual(harder, moved, found.status, mu, 1.0) == pytest.approx(0.1, rel=0.1)
    assert residual(found.force * np.nan, moved, found.status, mu, 1.0) == np.inf


@pytest.mark.parametrize(
    ("gap", "sign", "augmentation", "refusal"),
    [
        (0.0, 1.0, None, None),
        (np.nan, 1.0, None, Outcome.NOT_FINITE),
        (0.0, -1.0, None, Outcome.INDEFINITE),
        (0.0, -1.0, np.ones((2, 2)), None),
    ],
)
def test_what_cannot_be_solved_is_said_before_it_is_tried(
    gap: float, sign: float, augmentation: np.ndarray | None, refusal: Outcome | None
) -> None:
    rest, operator = ContactState.at_rest(np.zeros(2), 2), sign * np.eye(4).reshape(2, 2, 2, 2)
    problem = ContactProblem.of(rest, np.full((2, 2), gap), operator, ContactLaw(), 1.0, augmentation)
    assert problem.refusal is refusal
