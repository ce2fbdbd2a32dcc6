"""The active-set system is the derivative of the projection equation."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.contact.conditions import project_on_friction_cone, residual
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.newton import ActiveSet, ActiveSetSystem, Iterate, assemble, block_gauss_seidel, newton
from tests.contact_cases import random_problem


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_a_newton_step_solves_the_linearised_projection_equation(dim: int, seed: int) -> None:
    problem, force = random_problem(dim, seed)
    # one iteration of the method makes the friction at slipping points admissible, where the system is the derivative
    for _ in range(2):
        iterate = Iterate.of(problem, force)
        system = ActiveSetSystem.of(problem, ActiveSet.of(problem, iterate.status, iterate.augmented_force))
        force = system.solution()
    open_, stick, slip = (iterate.status == s for s in (OPEN, STICK, SLIP))
    displacement = problem.relative_displacement(force)
    scale = np.abs(force).max() + 1.0
    assert not force[open_].any()
    assert np.abs(displacement[stick]).max(initial=0.0) < 1e-9 * scale
    assert np.abs(displacement[slip, 0]).max(initial=0.0) < 1e-9 * scale
    along = np.sum(force[:, 1:] * iterate.augmented_force[:, 1:], axis=1) / np.maximum(
        np.linalg.norm(iterate.augmented_force[:, 1:], axis=1), 1e-300
    )
    assert along[slip] == pytest.approx(0.5 * force[slip, 0], abs=1e-9 * scale)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_matrix_is_that_of_the_blocks_written_out(dim: int) -> None:
    problem, force = random_problem(dim, 4)
    iterate = Iterate.of(problem, force)
    status = np.array([OPEN, STICK, SLIP, SLIP, STICK, OPEN, SLIP], dtype=np.int8)
    active = ActiveSet.of(problem, status, iterate.augmented_force)
    x = np.linspace(1.0, 2.0, active.size)
    w = problem.delassus @ active.force(x).ravel()  # displacements of these unknowns
    rho, m = problem.augmentation.ravel(), len(active.active_dofs)
    image = np.empty(len(x))
    image[:m] = rho[active.active_dofs] * w[active.active_dofs]
    if dim == 3:
        trial = iterate.augmented_force[active.slip_points]
        a = np.minimum(0.5 * trial[:, 0] / np.linalg.norm(trial[:, 1:], axis=1), 1.0)
        across = np.sum(active.tangent * (rho * w).reshape(-1, 3)[active.slip_points, 1:], axis=1)
        image[m:] = (1.0 - a) * x[m:] + a * across
    assert ActiveSetSystem.of(problem, active).solve(image) == pytest.approx(x, rel=1e-9)
    assert assemble(problem, active, np.float64) @ x == pytest.approx(image, rel=1e-9)


def test_the_forces_of_an_active_set_are_admissible() -> None:
    problem, force = random_problem(3, 4)
    status = np.array([OPEN, STICK, SLIP, SLIP, STICK, OPEN, SLIP], dtype=np.int8)
    active = ActiveSet.of(problem, status, Iterate.of(problem, force).augmented_force)
    x = np.linspace(1.0, 2.0, active.size)
    found = active.force(x)
    assert not found[status == OPEN].any()
    assert found[status == STICK].ravel() == pytest.approx(x[:6])
    slipping = found[status == SLIP]
    assert slipping[:, 0] == pytest.approx(x[6:9])
    direction = Iterate.of(problem, force).augmented_force[status == SLIP, 1:]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    assert np.sum(slipping[:, 1:] * direction, axis=1) == pytest.approx(0.5 * x[6:9])
    assert direction[:, 0] * slipping[:, 2] - direction[:, 1] * slipping[:, 1] == pytest.approx(x[9:])


def test_gauss_seidel_converges_to_the_solution_of_newton() -> None:
    problem, force = random_problem(3, 2)
    found = newton(problem, np.zeros_like(force), 60, damped=True)
    assert found.solved
    assert residual(found.force, found.relative_displacement, found.status, problem.friction, 1.0) < 1e-11
    swept = block_gauss_seidel(problem, np.zeros_like(force), 400)
    assert np.abs(swept - found.force).max() < 1e-9
    projected, _, _ = project_on_friction_cone(problem, swept, problem.relative_displacement(swept))
    assert np.abs(projected - swept).max() < 1e-9
