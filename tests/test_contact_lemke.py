"""Lemke's method solves linear complementarity problems, and in 2D finds the active set of the friction problem."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.contact.lemke import directions, friction_start, lemke
from finger3d.contact.newton import force_of_sets, newton
from tests.contact_cases import random_problem


@pytest.mark.parametrize("seed", range(8))
def test_a_solution_is_complementary(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(7, 7))
    matrix, q = a @ a.T + 0.1 * np.eye(7), rng.normal(size=7)
    z = lemke(matrix, q, 200)
    assert z is not None
    w = matrix @ z + q
    # the perturbation that excludes ties is 1e-9 to 2e-9 of the largest q
    assert min(z.min(), w.min()) > -1e-7
    assert np.abs(z * w).max() < 1e-7


def test_without_a_solution_there_is_none() -> None:
    assert lemke(-np.eye(2), np.array([-1.0, -1.0]), 50) is None
    assert lemke(np.eye(2), np.array([-1.0, -2.0]), 0) is None


@pytest.mark.parametrize("seed", range(12))
def test_in_two_dimensions_the_active_set_is_that_of_the_solution(seed: int) -> None:
    problem, force = random_problem(2, seed)
    points = np.arange(len(force))
    assert friction_start(problem, points, 4 * len(points) - 1) is None
    found = friction_start(problem, points, 4 * len(points))
    solution = newton(problem, np.zeros_like(force), 60, damped=True)
    assert found is not None
    assert solution.solved
    status, direction = found
    assert np.array_equal(status, solution.status)
    exact = force_of_sets(problem, status, np.hstack([np.zeros((len(force), 1)), direction]))
    assert np.abs(exact - solution.force).max() < 1e-9 * np.abs(solution.force).max()


def test_directions_span_the_tangent_plane() -> None:
    assert directions(1).tolist() == [[1.0], [-1.0]]
    polygon = directions(2, 6)
    assert np.linalg.norm(polygon, axis=1) == pytest.approx(1.0)
    assert polygon.sum(axis=0) == pytest.approx(0.0, abs=1e-14)
    assert np.linalg.det(polygon[:2]) == pytest.approx(np.sin(np.pi / 3.0))
