"""What makes contact quick: a start from normal contact, and corrections with a factor at hand; neither decides."""

from __future__ import annotations

from unittest.mock import Mock

import numpy as np
import pytest

from finger3d.contact import initial_guess as start
from finger3d.contact import newton
from finger3d.contact import solve as ladder
from finger3d.contact.conditions import PRECISION, ContactProblem, augmentation_parameters, project_on_friction_cone
from finger3d.contact.friction import SLIP, Coulomb
from finger3d.contact.initial_guess import initial_guess
from finger3d.contact.state import ContactSolution, ContactState
from tests.contact_cases import half_space, random_compliance


def sphere(points: int = 11, spacing: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Compliance and gap of a square of half-space points under a sphere of radius 1."""
    axis = spacing * (np.arange(points) - (points - 1) / 2.0)
    x, z = (a.ravel() for a in np.meshgrid(axis, axis))
    return half_space(x, z, spacing, 0.3), 0.5 * (x**2 + z**2)


def increments(compliance: np.ndarray, free: np.ndarray, mu: float) -> ContactProblem:
    c, d = free.shape
    matrix = compliance.reshape(c * d, c * d)
    return ContactProblem(free, matrix, np.full(c, mu), augmentation_parameters(matrix, d), 1.0)


def pressed(compliance: np.ndarray, gap: np.ndarray, mu: float) -> list[ContactSolution]:
    """Four increments: two of pressing, two with a slide askew."""
    state, out = ContactState.at_rest(gap, 3), []
    for depth, x, z in ((0.05, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.004, 0.002), (0.1, 0.008, 0.004)):
        free = np.stack([gap - depth, np.full(len(gap), -x), np.full(len(gap), -z)], axis=1)
        out.append(ladder.solve_increment(state, free, compliance, Coulomb(mu), 0.1))
        assert out[-1].outcome.ok
        state = out[-1].state
    return out


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("bearing", [0, 1, 4, 9])
def test_forces_of_the_first_points_move_all_points(dim: int, bearing: int) -> None:
    rng = np.random.default_rng(bearing)
    problem = increments(random_compliance(rng, 9, dim, 1.0), rng.normal(size=(9, dim)), 0.25)
    force = np.zeros((9, dim))
    force[:bearing] = rng.normal(size=(bearing, dim))
    moved = problem.free_motion + (problem.delassus @ force.ravel()).reshape(9, dim)
    assert problem.relative_displacement(force) == pytest.approx(moved, abs=1e-13)
    assert problem.gap(force) == pytest.approx(moved[:, 0], abs=1e-13)


@pytest.mark.parametrize(
    ("dim", "precision", "digits"),
    [(2, np.float64, 1e-12), (3, np.float64, 1e-12), (3, np.float32, 1e-6)],  # round-off, times a condition below 10
)
def test_without_friction_the_start_is_the_answer(
    monkeypatch: pytest.MonkeyPatch, dim: int, precision: type, digits: float
) -> None:
    monkeypatch.setitem(PRECISION, dim, precision)
    rng = np.random.default_rng(3)
    compliance, free = random_compliance(rng, 9, dim, 1.0), rng.normal(size=(9, dim))
    found = initial_guess(increments(compliance, free, 0.0), np.zeros((9, dim)))
    wanted = ladder.solve_increment(ContactState.at_rest(np.zeros(9), dim), free, compliance, Coulomb(0.0), 1.0)
    assert wanted.outcome.ok
    assert wanted.state.force[:, 0].max() > 0.0
    assert np.abs(found - wanted.state.force).max() < digits * wanted.state.force.max()


@pytest.mark.parametrize(("share", "kept"), [(1.0, True), (0.995, True), (0.9, False), (0.7, False)])
def test_forces_expected_are_the_start_where_they_nearly_fit_and_not_where_only_the_same_points_touch(
    share: float, kept: bool
) -> None:
    compliance, gap = sphere()
    free = np.stack([gap - 0.1, np.full(len(gap), 0.02), np.zeros(len(gap))], axis=1)
    answer = ladder.solve_increment(ContactState.at_rest(gap, 3), free, compliance, Coulomb(0.25), 1.0).state
    wanted = answer.force
    expected = wanted.copy()
    expected[:, 1:] *= share  # a force within its bound is wrong only by what it lets move
    problem = increments(compliance, free, 0.25)
    moved = problem.relative_displacement(expected)
    assert np.array_equal(expected[:, 0] > 0.0, expected[:, 0] > problem.augmentation[:, 0] * moved[:, 0])
    found = initial_guess(problem, expected)
    assert (found is expected) == kept
    if not kept:
        assert np.linalg.norm(found - wanted) < 0.1 * np.linalg.norm(expected - wanted)


def test_the_start_is_admissible_and_each_turn_nearer_to_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    compliance, gap = sphere()
    free = np.stack([gap - 0.1, *np.zeros((2, len(gap)))], axis=1)
    problem = increments(compliance, free, 0.25)
    answer = ladder.solve_increment(ContactState.at_rest(np.zeros(len(gap)), 3), free, compliance, Coulomb(0.25), 0.1)
    assert answer.outcome.ok
    wanted = answer.state.force
    usual = initial_guess(problem, np.zeros_like(wanted))
    assert np.linalg.norm(usual - wanted) < start._SETTLED * np.linalg.norm(wanted)
    assert (np.linalg.norm(usual[:, 1:], axis=1) <= 0.25 * (1.0 + 1e-6) * usual[:, 0]).all()  # single precision
    left = []
    monkeypatch.setitem(PRECISION, 3, np.float64)
    monkeypatch.setattr(start, "_TURN", 40)  # which carries a turn to its end
    monkeypatch.setattr(start, "_STILL", 0.0)
    for turns in (1, 2, 3, 4):
        monkeypatch.setattr(start, "_STEPS", 40 * turns)
        found = initial_guess(problem, np.zeros_like(wanted))
        assert (np.linalg.norm(found[:, 1:], axis=1) <= (0.25 + 1e-12) * found[:, 0]).all()
        left.append(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))
    # friction and normal forces answer each other by mu times Dundurs' beta = 0.29 here: a turn leaves about 7 %
    assert left[0] < 0.07
    assert (np.divide(left[1:], left[:-1]) < 0.1).all()


def test_a_singular_compliance_leaves_the_start_as_it_is() -> None:
    free = np.full((2, 2), -1.0)
    force = np.array([[1.0, 0.0], [0.0, 0.0]])
    problem = ContactProblem(free, np.ones((4, 4)), np.full(2, 0.3), np.ones((2, 2)), 1.0)
    assert initial_guess(problem, force) is force


@pytest.mark.parametrize("mu", [0.06, 0.25, 1.0])
def test_start_and_corrections_change_what_it_takes_and_not_the_answer(
    monkeypatch: pytest.MonkeyPatch, mu: float
) -> None:
    compliance, gap = sphere()
    quick = pressed(compliance, gap, mu)
    monkeypatch.setattr(newton, "_CORRECTIONS", 0)
    monkeypatch.setattr(newton, "_SINGLE", 0)
    monkeypatch.setattr(ladder, "initial_guess", lambda problem, force: force)
    plain = pressed(compliance, gap, mu)
    for a, b in zip(quick, plain, strict=True):
        assert np.array_equal(a.state.status, b.state.status)
        assert np.abs(a.state.force - b.state.force).max() < 1e-10 * b.state.force.max()
    assert sum(a.iterations for a in quick) < 0.75 * sum(b.iterations for b in plain)


@pytest.mark.parametrize("mu", [0.0, 0.06, 0.25, 1.0])
def test_single_precision_costs_no_digit_and_hardly_an_iteration(monkeypatch: pytest.MonkeyPatch, mu: float) -> None:
    compliance, gap = sphere()
    single = pressed(compliance, gap, mu)
    monkeypatch.setattr(newton, "_SINGLE", 0)
    double = pressed(compliance, gap, mu)
    for a, b in zip(single, double, strict=True):
        assert np.array_equal(a.state.status, b.state.status)
        assert np.abs(a.state.force - b.state.force).max() < 1e-10 * b.state.force.max()
        assert (a.method, b.method) == ("newton", "newton")
    assert sum(a.iterations for a in single) <= sum(b.iterations for b in double) + 1


@pytest.mark.parametrize(("dim", "mu", "used"), [(3, 0.25, True), (3, 1e6, False), (2, 0.25, False)])
def test_single_precision_is_for_three_dimensions_and_moderate_friction(
    monkeypatch: pytest.MonkeyPatch, dim: int, mu: float, used: bool
) -> None:
    compliance, gap = sphere()
    free = np.stack([gap - 0.1, *np.zeros((2, len(gap)))], axis=1)
    problem = increments(compliance[:, :dim, :, :dim], free[:, :dim], mu)
    found = []
    monkeypatch.setattr(newton, "newton", lambda *args: found.append(args[4:]) or Mock(solved=True))
    newton.mixed_precision_newton(problem, np.zeros_like(problem.free_motion), 30, False)
    assert found == ([(np.float32,)] if used else [()])


def test_what_single_precision_cannot_settle_is_settled_in_double() -> None:
    # two points that move together but for a hundred-millionth, and a third to keep them company
    compliance = np.kron(np.array([[1.0, 1.0 - 1e-8, 0.0], [1.0 - 1e-8, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.eye(3))
    free = np.zeros((3, 3))
    free[:, 0] = -1.0
    problem = increments(compliance.reshape(3, 3, 3, 3), free, 0.25)
    single = newton.newton(problem, np.ones_like(free), newton._SINGLE, True, np.float32)
    assert not single.solved
    double = newton.newton(problem, np.ones_like(free), 30, True)
    assert double.solved
    both = newton.mixed_precision_newton(problem, np.ones_like(free), 30, True)
    assert np.array_equal(both.force, double.force)
    assert both.iterations == single.iterations + double.iterations
    assert both.force[:, 0] == pytest.approx([1.0 / (2.0 - 1e-8)] * 2 + [1.0], rel=1e-7)


def test_a_correction_shrinks_the_mismatch_of_slip_directions() -> None:
    compliance, gap = sphere()
    state = pressed(compliance, gap, 0.25)[1].state
    free = np.stack([gap - 0.1, *np.zeros((2, len(gap)))], axis=1)
    free[:, 1:] -= 0.01
    problem = increments(compliance, free, 0.25)
    start = newton.newton(problem, state.force, 30, damped=False)
    assert start.solved
    slips = start.status == SLIP
    assert slips.sum() > 5
    # slip directions a little astray; the system is that of these
    angle = 0.01 * np.random.default_rng(0).normal(size=len(gap))
    astray = start.force.copy()
    astray[slips, 1] -= (angle * start.force[:, 2])[slips]
    astray[slips, 2] += (angle * start.force[:, 1])[slips]
    _, status, trial = project_on_friction_cone(problem, astray, problem.relative_displacement(astray))
    assert (status == start.status).all()
    system = newton._System.of(problem, status, trial)
    force = system.rubbing(system.solution())
    sizes = []
    for _ in range(3):
        projected, _, _ = project_on_friction_cone(problem, force, problem.relative_displacement(force))
        sizes.append(np.linalg.norm(force - projected))
        force = system.corrected(force, force - projected)
    assert sizes[1] < 0.1 * sizes[0]
    assert sizes[2] < 0.1 * sizes[1]
