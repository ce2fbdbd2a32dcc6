"""Solvers of one increment of frictional contact."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from finger3d.contact.acceleration import accelerated_newton
from finger3d.contact.conditions import ContactProblem, project_on_friction_cone, residual
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.lemke import friction_start, lemke
from finger3d.contact.newton import (
    ActiveSet,
    ActiveSetSystem,
    Iterate,
    NewtonResult,
    assemble,
    block_gauss_seidel,
    force_of_sets,
    newton,
    uniqueness,
)
from finger3d.contact.solve import maeno_active_set, solve_increment
from finger3d.contact.state import ContactSolution, ContactState, next_state
from finger3d.errors import Outcome
from tests.contact_cases import half_plane, half_space, problem_of, random_compliance, random_problem, violation

COEFFICIENTS = [0.0, 1e-6, 0.06, 0.25, 1.0, 5.0, 1e6]


def press(compliance: np.ndarray, gap: np.ndarray, path: list[tuple[float, ...]], mu: float) -> list[ContactState]:
    """States along a path of (depth, slide...), each checked."""
    d = compliance.shape[1]
    state = ContactState.at_rest(gap, d)
    out = []
    for target in path:
        free = np.zeros((len(gap), d))
        free[:, 0] = gap - target[0]
        free[:, 1:] = -np.asarray(target[1:])[: d - 1]
        found = solve_increment(problem_of(compliance, free, mu, state=state))
        assert found.outcome is Outcome.CONVERGED, (mu, target, found.outcome.name)
        assert found.residual <= 1e-8
        assert violation(state, found.state, free, compliance, mu) <= 1e-8
        state = found.state
        out.append(state)
    return out


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    points=st.integers(1, 7),
    dim=st.sampled_from([2, 3]),
    mu=st.sampled_from(COEFFICIENTS),
    softness=st.sampled_from([1e-3, 0.05, 1.0]),
)
def test_any_state_returned_as_converged_meets_every_condition(
    seed: int, points: int, dim: int, mu: float, softness: float
) -> None:
    rng = np.random.default_rng(seed)
    compliance = random_compliance(rng, points, dim, softness)
    gap = rng.uniform(0.0, 1.0, points)
    state = ContactState.at_rest(gap, dim)
    for _ in range(4):
        free = rng.normal(size=(points, dim))
        free[:, 0] += 0.3
        found = solve_increment(problem_of(compliance, free, mu, state=state))
        if found.outcome.ok:
            assert violation(state, found.state, free, compliance, mu) <= 1e-8
            state = found.state
        else:
            # what could not be settled is said, and the state before is handed back untouched
            assert found.outcome is Outcome.NO_CONVERGENCE
            assert found.state is state
            assert dim == 3 or mu > 1.0


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), points=st.integers(1, 8), mu=st.sampled_from(COEFFICIENTS))
def test_in_two_dimensions_every_random_increment_settles(seed: int, points: int, mu: float) -> None:
    rng = np.random.default_rng(seed)
    compliance = random_compliance(rng, points, 2)
    gap = rng.uniform(0.0, 0.5, points)
    path = [tuple(rng.uniform([-0.2, -1], [1, 1])) for _ in range(4)]
    assert len(press(compliance, gap, path, mu)) == len(path)  # each settled, and its conditions proved, on the way


@pytest.mark.parametrize("mu", [0.0, 0.25, 5.0, 1e6])
@pytest.mark.parametrize("beta", [0.0, 0.2857])
@pytest.mark.parametrize("dim", [2, 3])
def test_press_slide_release_press_settles(mu: float, beta: float, dim: int) -> None:
    x = np.linspace(-1.0, 1.0, 41)
    path = [(0.2, 0.0, 0.0), (0.4, 0.0, 0.0), (0.4, 0.1, 0.05), (0.4, 1.0, 0.5), (0.2, 1.0, 0.5), (0.0, 1.0, 0.5)]
    states = press(half_plane(41, dim, beta, 0.05), x**2, [*path, (0.4, 1.0, 0.5)], mu)
    assert states[0].force[:, 0].sum() > 0
    assert not states[5].force.any()  # released
    assert (states[3].status != STICK).all() or mu > 1.0  # slid by more than the contact's length


def test_uncoupled_third_axis_gives_the_two_dimensional_answer() -> None:
    gap = np.linspace(-1.0, 1.0, 31) ** 2
    path = [(0.1 * k, 0.0, 0.0) for k in range(1, 5)] + [(0.4, 0.02 * k, 0.0) for k in range(1, 5)]
    flat = press(half_plane(31, 2, 0.2857), gap, path, 0.25)
    solid = press(half_plane(31, 3, 0.2857), gap, path, 0.25)
    for a, b in zip(flat, solid, strict=True):
        assert np.array_equal(a.status, b.status)
        assert np.abs(a.force - b.force[:, :2]).max() < 1e-12 * np.abs(a.force).max()
        assert not b.force[:, 2].any()


def states_3d(points: int = 12) -> tuple[np.ndarray, np.ndarray, list[tuple[float, ...]]]:
    rng = np.random.default_rng(5)
    compliance = random_compliance(rng, points, 3, 0.5)
    return compliance, rng.uniform(0.0, 0.3, points), [(0.3, 0.0, 0.0), (0.6, 0.05, 0.1), (0.6, 0.2, -0.1)]


def test_scene_turned_by_37_degrees_about_the_normal() -> None:
    compliance, gap, path = states_3d()
    angle = np.deg2rad(37.0)
    turn = np.eye(3)
    turn[1:, 1:] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turned = np.einsum("ad,idjk,bk->iajb", turn, compliance, turn)
    moved = [(p[0], *(turn[1:, 1:] @ p[1:])) for p in path]
    for a, b in zip(press(compliance, gap, path, 0.3), press(turned, gap, moved, 0.3), strict=True):
        assert np.array_equal(a.status, b.status)
        assert np.abs(a.force @ turn.T - b.force).max() < 1e-11


def test_millimetres_and_metres_agree() -> None:
    compliance, gap, path = states_3d()
    metres = [tuple(1e-3 * v for v in p) for p in path]
    for a, b in zip(press(compliance, gap, path, 0.3), press(1e-3 * compliance, 1e-3 * gap, metres, 0.3), strict=True):
        assert np.array_equal(a.status, b.status)
        assert np.abs(a.force - b.force).max() < 1e-11 * np.abs(a.force).max()


def test_mirror_symmetric_press_gives_mirrored_states_and_no_net_friction() -> None:
    state = press(half_plane(41, 2, 0.2857, 0.05), np.linspace(-1, 1, 41) ** 2, [(0.2, 0.0), (0.4, 0.0)], 0.25)[-1]
    assert np.array_equal(state.status, state.status[::-1])
    assert np.abs(state.force[:, 0] - state.force[::-1, 0]).max() < 1e-12
    assert abs(state.force[:, 1].sum()) < 1e-12


def test_without_friction_nothing_sticks_and_tangents_do_not_matter() -> None:
    compliance, gap, path = states_3d()
    with_tangents = press(compliance, gap, path, 0.0)[-1]
    normal_only = press(compliance[:, :1, :, :1], gap, [(p[0],) for p in path], 0.0)[-1]
    assert set(np.unique(with_tangents.status)) <= {OPEN, SLIP}
    assert not with_tangents.force[:, 1:].any()
    assert np.abs(with_tangents.force[:, :1] - normal_only.force).max() < 1e-12


def test_infinite_friction_is_tied_on_touch() -> None:
    compliance = half_plane(21, 2, 0.2)
    gap = np.linspace(-1, 1, 21) ** 2
    for state in press(compliance, gap, [(0.1 * k, 0.0) for k in range(1, 8)], 1e6):
        assert (state.status != SLIP).all()


def test_a_failed_increment_leaves_the_state_and_a_repeat_gives_the_same() -> None:
    compliance, gap, path = states_3d()
    first = press(compliance, gap, path[:1], 0.3)[0]
    free = np.column_stack([gap - 0.6, np.full(len(gap), -0.05), np.full(len(gap), -0.1)])
    broken = free.copy()
    broken[0, 0] = np.nan
    failed = solve_increment(problem_of(compliance, broken, 0.3, state=first))
    assert failed.outcome is Outcome.NOT_FINITE
    assert failed.state is first
    a, b = (solve_increment(problem_of(compliance, free, 0.3, state=first)).state for _ in range(2))
    assert np.array_equal(a.force, b.force)


def test_floating_body_and_nan_are_outcomes_not_numbers() -> None:
    compliance, gap, _ = states_3d()
    state = ContactState.at_rest(gap, 3)
    free = np.column_stack([gap - 0.3, np.zeros((len(gap), 2))])
    bad = compliance.copy()
    bad[0, 1, 0, 1] = -1.0
    assert solve_increment(problem_of(bad, free, 0.3, state=state)).outcome is Outcome.INDEFINITE
    assert solve_increment(problem_of(compliance * np.nan, free, 0.3, state=state)).outcome is Outcome.NOT_FINITE


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("rule", [solve_increment, maeno_active_set])
def test_a_number_that_is_none_shows_wherever_it_is_between_points_that_touch(
    rule: Callable[..., ContactSolution], value: float
) -> None:
    compliance, gap, path = states_3d()
    before = press(compliance, gap, path[:1], 0.3)[0]
    free = np.column_stack([gap - 0.6, np.full(len(gap), -0.05), np.full(len(gap), -0.1)])
    touching = np.flatnonzero(solve_increment(problem_of(compliance, free, 0.3, state=before)).state.force[:, 0])
    for i, j, a, b in ((0, -1, 0, 0), (1, 2, 1, 2), (-1, 0, 2, 0)):
        bad = compliance.copy()
        bad[touching[i], a, touching[j], b] = bad[touching[j], b, touching[i], a] = value
        for state in (ContactState.at_rest(gap, 3), before):
            found = rule(problem_of(bad, free, 0.3, state=state))
            assert found.outcome is Outcome.NOT_FINITE
            assert found.state is state


def test_one_point_coulomb_is_unique_below_its_critical_coefficient() -> None:
    # validation/REFERENCES.md, 8.1: stiffness [[1, .8], [.8, 2]] in (t, n), critical at K_tt / |K_tn| = 1.25
    stiffness = np.array([[2.0, 0.8], [0.8, 1.0]])  # (n, t)
    compliance = np.linalg.inv(stiffness).reshape(1, 2, 1, 2)
    assert uniqueness(np.array([1.25]), compliance.reshape(1, 2, 2)) == pytest.approx(1.0, rel=1e-12)
    rng = np.random.default_rng(0)
    for mu in (0.5, 1.2, 2.0, 10.0):
        for _ in range(50):
            press(compliance, np.array([0.0]), [tuple(rng.uniform(-1, 1, 2)) for _ in range(3)], mu)


Method = Callable[[ContactProblem, np.ndarray, int, bool], NewtonResult]


def sphere(points: int = 11, spacing: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Compliance and gap of a square of half-space points under a sphere of radius 1."""
    axis = spacing * (np.arange(points) - (points - 1) / 2.0)
    x, z = (a.ravel() for a in np.meshgrid(axis, axis))
    return half_space(x, z, spacing, 0.3), 0.5 * (x**2 + z**2)


def parabola() -> tuple[np.ndarray, np.ndarray]:
    """Compliance and gap of a line of half-plane points under a parabola."""
    return half_plane(41, 2, 0.2857, 0.05), np.linspace(-1.0, 1.0, 41) ** 2


def pressed(method: Method, compliance: np.ndarray, gap: np.ndarray, mu: float) -> list[NewtonResult]:
    """Four increments: two of pressing, two with an oblique slide."""
    d = compliance.shape[1]
    state, out = ContactState.at_rest(gap, d), []
    for depth, x, z in ((0.05, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.004, 0.002), (0.1, 0.008, 0.004)):
        free = np.stack([gap - depth, np.full(len(gap), -x), np.full(len(gap), -z)], axis=1)[:, :d]
        problem = problem_of(compliance, free, mu, 0.1, state=state)
        out.append(method(problem, state.force, 60, True))
        assert out[-1].solved
        state = next_state(state, out[-1].force, out[-1].relative_displacement, out[-1].status)
    return out


@pytest.mark.parametrize("mu", [0.0, 0.25, 10.0])
@pytest.mark.parametrize("case", [parabola, sphere])
def test_plain_and_accelerated_newton_agree(case: Callable[[], tuple[np.ndarray, np.ndarray]], mu: float) -> None:
    fast, plain = (pressed(method, *case(), mu) for method in (accelerated_newton, newton))
    for a, b in zip(fast, plain, strict=True):
        assert np.array_equal(a.status, b.status)
        assert np.abs(a.force - b.force).max() < 1e-10 * b.force.max()
        assert np.abs(a.relative_displacement - b.relative_displacement).max() < 1e-11


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


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(2))
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


def test_gauss_seidel_converges_to_the_solution_of_newton() -> None:
    problem, force = random_problem(3, 2)
    found = newton(problem, np.zeros_like(force), 60, damped=True)
    assert found.solved
    assert residual(found.force, found.relative_displacement, found.status, problem.friction, 1.0) < 1e-11
    swept = block_gauss_seidel(problem, np.zeros_like(force), 400)
    assert np.abs(swept - found.force).max() < 1e-9
    projected, _, _ = project_on_friction_cone(problem, swept, problem.relative_displacement(swept))
    assert np.abs(projected - swept).max() < 1e-9


@pytest.mark.parametrize("seed", range(2))
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


@pytest.mark.parametrize("seed", range(4))
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
