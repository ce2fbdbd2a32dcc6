"""The accelerated Newton method gives the solution of the plain one, in fewer iterations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from finger3d.contact.acceleration import accelerated_newton, assemble_in_place, chord_step, threads_for, warm_start
from finger3d.contact.conditions import ContactProblem, augmentation_parameters
from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.law import ContactLaw
from finger3d.contact.newton import ActiveSet, ActiveSetSystem, Iterate, NewtonResult, Precision, assemble, newton
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState, next_state
from tests.contact_cases import half_plane, half_space, random_compliance, random_problem

Method = Callable[[ContactProblem, np.ndarray, int, bool], NewtonResult]


def sphere(points: int = 11, spacing: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Compliance and gap of a square of half-space points under a sphere of radius 1."""
    axis = spacing * (np.arange(points) - (points - 1) / 2.0)
    x, z = (a.ravel() for a in np.meshgrid(axis, axis))
    return half_space(x, z, spacing, 0.3), 0.5 * (x**2 + z**2)


def parabola() -> tuple[np.ndarray, np.ndarray]:
    """Compliance and gap of a line of half-plane points under a parabola."""
    return half_plane(41, 2, 0.2857, 0.05), np.linspace(-1.0, 1.0, 41) ** 2


def problem_of(compliance: np.ndarray, free: np.ndarray, mu: float, scale: float = 1.0) -> ContactProblem:
    at_rest = ContactState.at_rest(np.zeros(len(free)), free.shape[1])
    return ContactProblem.of(at_rest, free, compliance, ContactLaw(Coulomb(mu)), scale)


def pressed(method: Method, compliance: np.ndarray, gap: np.ndarray, mu: float) -> list[NewtonResult]:
    """Four increments: two of pressing, two with an oblique slide."""
    d = compliance.shape[1]
    state, out = ContactState.at_rest(gap, d), []
    for depth, x, z in ((0.05, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.004, 0.002), (0.1, 0.008, 0.004)):
        free = np.stack([gap - depth, np.full(len(gap), -x), np.full(len(gap), -z)], axis=1)[:, :d]
        problem = ContactProblem.of(state, free, compliance, ContactLaw(Coulomb(mu)), 0.1)
        out.append(method(problem, state.force, 60, True))
        assert out[-1].solved
        state = next_state(state, out[-1].force, out[-1].relative_displacement, out[-1].status)
    return out


@pytest.mark.parametrize("mu", [0.0, 0.06, 0.25, 1.0, 10.0])
@pytest.mark.parametrize("case", [parabola, sphere])
def test_plain_and_accelerated_newton_agree(case: Callable[[], tuple[np.ndarray, np.ndarray]], mu: float) -> None:
    fast, plain = (pressed(method, *case(), mu) for method in (accelerated_newton, newton))
    for a, b in zip(fast, plain, strict=True):
        assert np.array_equal(a.status, b.status)
        assert np.abs(a.force - b.force).max() < 1e-10 * b.force.max()
        assert np.abs(a.relative_displacement - b.relative_displacement).max() < 1e-11
    assert sum(a.iterations for a in fast) <= sum(b.iterations for b in plain)
    if case is sphere and 0.0 < mu <= 1.0:
        assert sum(a.iterations for a in fast) < 0.5 * sum(b.iterations for b in plain)


def test_what_single_precision_cannot_settle_is_settled_in_double() -> None:
    # two points that move together but for a hundred-millionth, and an independent third
    coupling = np.array([[1.0, 1.0 - 1e-8, 0.0], [1.0 - 1e-8, 1.0, 0.0], [0.0, 0.0, 1.0]])
    free = np.zeros((3, 3))
    free[:, 0] = -1.0
    problem = problem_of(np.kron(coupling, np.eye(3)).reshape(3, 3, 3, 3), free, 0.25)
    assert not newton(problem, np.ones_like(free), 4, True, np.float32).solved
    found = accelerated_newton(problem, np.ones_like(free), 30, True)
    assert found.solved
    assert found.force[:, 0] == pytest.approx([1.0 / (2.0 - 1e-8)] * 2 + [1.0], rel=1e-7)


@pytest.mark.parametrize(("dim", "accuracy"), [(2, 1e-12), (3, 1e-6)])  # round-off of double and of single precision
def test_without_friction_the_warm_start_is_the_solution(dim: int, accuracy: float) -> None:
    rng = np.random.default_rng(3)
    compliance, free = random_compliance(rng, 9, dim, 1.0), rng.normal(size=(9, dim))
    start = warm_start(problem_of(compliance, free, 0.0), np.zeros((9, dim)))
    wanted = solve_increment(
        ContactProblem.of(ContactState.at_rest(np.zeros(9), dim), free, compliance, ContactLaw(Coulomb(0.0)), 1.0)
    )
    assert wanted.outcome.ok
    assert wanted.state.force[:, 0].max() > 0.0
    assert np.abs(start - wanted.state.force).max() < accuracy * wanted.state.force.max()


@pytest.mark.parametrize(("share", "kept"), [(1.0, True), (0.995, True), (0.9, False), (0.7, False)])
def test_expected_forces_are_the_warm_start_if_they_nearly_fit(share: float, kept: bool) -> None:
    compliance, gap = sphere()
    free = np.stack([gap - 0.1, np.full(len(gap), 0.02), np.zeros(len(gap))], axis=1)
    wanted = solve_increment(
        ContactProblem.of(ContactState.at_rest(gap, 3), free, compliance, ContactLaw(Coulomb(0.25)), 1.0)
    ).state.force
    expected = wanted.copy()
    expected[:, 1:] *= share
    start = warm_start(problem_of(compliance, free, 0.25), expected)
    assert np.array_equal(start, expected) == kept
    if not kept:
        assert np.linalg.norm(start - wanted) < 0.1 * np.linalg.norm(expected - wanted)


def test_the_warm_start_is_admissible_and_close() -> None:
    compliance, gap = sphere()
    free = np.stack([gap - 0.1, *np.zeros((2, len(gap)))], axis=1)
    wanted = solve_increment(
        ContactProblem.of(ContactState.at_rest(np.zeros(len(gap)), 3), free, compliance, ContactLaw(Coulomb(0.25)), 0.1)
    )
    assert wanted.outcome.ok
    start = warm_start(problem_of(compliance, free, 0.25), np.zeros_like(free))
    assert np.linalg.norm(start - wanted.state.force) < 1e-3 * np.linalg.norm(wanted.state.force)
    assert (np.linalg.norm(start[:, 1:], axis=1) <= 0.25 * (1.0 + 1e-6) * start[:, 0]).all()


def test_a_singular_operator_leaves_the_expected_forces() -> None:
    force = np.array([[1.0, 0.0], [0.0, 0.0]])
    problem = problem_of(np.ones((2, 2, 2, 2)), np.full((2, 2), -1.0), 0.3)
    assert np.array_equal(warm_start(problem, force), force)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("precision", [np.float64, np.float32])
@pytest.mark.parametrize("seed", range(4))
def test_the_matrix_assembled_in_place_is_that_of_the_plain_assembly(dim: int, precision: Precision, seed: int) -> None:
    problem, force = random_problem(dim, seed, points=12)
    status = np.random.default_rng(seed).permutation(np.repeat([OPEN, STICK, SLIP], 4)).astype(np.int8)
    status[:seed] = OPEN
    active = ActiveSet.of(problem, status, Iterate.of(problem, force).augmented_force)
    wanted = assemble(problem, active, np.float64)
    found = assemble_in_place(problem, active, precision)
    assert found.dtype == precision
    # an entry is a sum of at most nine products of numbers of order 1
    assert np.abs(found - wanted).max() <= 50.0 * np.finfo(precision).eps * np.abs(wanted).max()


def test_chord_steps_reduce_the_mismatch_of_slip_directions() -> None:
    compliance, gap = sphere()
    pressing = pressed(newton, compliance, gap, 0.25)[1]
    free = np.stack([gap - 0.1, *np.zeros((2, len(gap)))], axis=1)
    free[:, 1:] -= 0.01
    problem = problem_of(compliance, free, 0.25)
    found = newton(problem, pressing.force, 30, damped=False)
    assert found.solved
    slips = found.status == SLIP
    assert slips.sum() > 5
    # the system is assembled for slip directions that are 0.01 rad off
    angle = 0.01 * np.random.default_rng(0).normal(size=len(gap))
    turned = found.force.copy()
    turned[slips, 1] -= (angle * found.force[:, 2])[slips]
    turned[slips, 2] += (angle * found.force[:, 1])[slips]
    before = Iterate.of(problem, turned)
    assert (before.status == found.status).all()
    system = ActiveSetSystem.of(problem, ActiveSet.of(problem, before.status, before.augmented_force))
    force = chord_step(system, system.solution(), np.zeros_like(free))
    mismatches = []
    for _ in range(3):
        iterate = Iterate.of(problem, force)
        mismatches.append(iterate.mismatch)
        force = chord_step(system, force, force - iterate.projected)
    assert mismatches[1] < 0.1 * mismatches[0]
    assert mismatches[2] < 0.1 * mismatches[1]


def test_small_systems_run_on_one_thread() -> None:
    from threadpoolctl import threadpool_info

    with threads_for(600):
        assert {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"} == {1}


def test_augmentation_is_isotropic_in_the_tangent_plane() -> None:
    rho = augmentation_parameters(np.diag([1.0, 2.0, 4.0]), 3)
    assert rho == pytest.approx(np.array([[1.0, 0.25, 0.25]]))


def test_points_of_a_nearly_floating_body_stick_to_round_off() -> None:
    """Single precision loses digits where soft springs alone hold the body; chord iterations bring them back."""
    compliance, gap = sphere()
    soft = compliance + 3e5 * np.einsum("k,l->kl", [0.0, 1.0, 0.0], [0.0, 1.0, 0.0])[None, :, None, :]
    free = np.column_stack([gap - 0.05, np.full_like(gap, 0.01), np.zeros_like(gap)])
    problem = problem_of(soft, free, 1.0)
    found = accelerated_newton(problem, np.zeros_like(free), 60, True)
    assert found.solved
    slip = np.linalg.norm(found.relative_displacement[found.status == STICK, 1:], axis=1)
    assert 0.0 < len(slip)
    # forces at round-off alone would leave slips of 2e-12; their own round-off times this compliance is 6e-14
    assert slip.max() <= 5e-13
