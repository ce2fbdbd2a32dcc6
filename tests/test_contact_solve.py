"""The contact solution: every condition holds, in every dimension, under every numbering, unit and turn."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.law import ContactLaw
from finger3d.contact.newton import uniqueness
from finger3d.contact.rules import maeno_active_set
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.errors import Outcome
from tests.contact_cases import half_plane, random_compliance, violation

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
        found = solve_increment(ContactProblem.of(state, free, compliance, ContactLaw(Coulomb(mu)), 1.0))
        assert found.outcome is Outcome.CONVERGED, (mu, target, found.outcome.name)
        assert found.residual <= 1e-8
        assert violation(state, found.state, free, compliance, mu) <= 1e-8
        state = found.state
        out.append(state)
    return out


@settings(max_examples=150, deadline=None)
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
        found = solve_increment(ContactProblem.of(state, free, compliance, ContactLaw(Coulomb(mu)), 1.0))
        if found.outcome.ok:
            assert violation(state, found.state, free, compliance, mu) <= 1e-8
            state = found.state
        else:
            # what could not be settled is said, and the state before is handed back untouched
            assert found.outcome is Outcome.NO_CONVERGENCE
            assert found.state is state
            assert dim == 3 or mu > 1.0


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), points=st.integers(1, 8), mu=st.sampled_from(COEFFICIENTS))
def test_in_two_dimensions_every_random_increment_settles(seed: int, points: int, mu: float) -> None:
    rng = np.random.default_rng(seed)
    compliance = random_compliance(rng, points, 2)
    gap = rng.uniform(0.0, 0.5, points)
    path = [tuple(rng.uniform([-0.2, -1], [1, 1])) for _ in range(4)]
    assert len(press(compliance, gap, path, mu)) == len(path)  # each settled, and its conditions proved, on the way


@pytest.mark.parametrize("mu", COEFFICIENTS)
@pytest.mark.parametrize("beta", [0.0, 0.2857, 0.5])
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


def test_numbering_does_not_matter() -> None:
    compliance, gap, path = states_3d()
    order = np.random.default_rng(1).permutation(len(gap))
    turned = press(compliance[order][:, :, order], gap[order], path, 0.3)
    for a, b in zip(press(compliance, gap, path, 0.3), turned, strict=True):
        assert np.array_equal(a.status[order], b.status)
        assert np.abs(a.force[order] - b.force).max() < 1e-12


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
    failed = solve_increment(ContactProblem.of(first, broken, compliance, ContactLaw(Coulomb(0.3)), 1.0))
    assert failed.outcome is Outcome.NOT_FINITE
    assert failed.state is first
    a, b = (
        solve_increment(ContactProblem.of(first, free, compliance, ContactLaw(Coulomb(0.3)), 1.0)).state
        for _ in range(2)
    )
    assert np.array_equal(a.force, b.force)


def test_floating_body_and_nan_are_outcomes_not_numbers() -> None:
    compliance, gap, _ = states_3d()
    state = ContactState.at_rest(gap, 3)
    free = np.column_stack([gap - 0.3, np.zeros((len(gap), 2))])
    bad = compliance.copy()
    bad[0, 1, 0, 1] = -1.0
    assert (
        solve_increment(ContactProblem.of(state, free, bad, ContactLaw(Coulomb(0.3)), 1.0)).outcome
        is Outcome.INDEFINITE
    )
    assert (
        solve_increment(ContactProblem.of(state, free, compliance * np.nan, ContactLaw(Coulomb(0.3)), 1.0)).outcome
        is Outcome.NOT_FINITE
    )


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("rule", [solve_increment, maeno_active_set])
def test_a_number_that_is_none_shows_wherever_it_is_between_points_that_touch(
    rule: Callable[..., ContactSolution], value: float
) -> None:
    compliance, gap, path = states_3d()
    before = press(compliance, gap, path[:1], 0.3)[0]
    free = np.column_stack([gap - 0.6, np.full(len(gap), -0.05), np.full(len(gap), -0.1)])
    touching = np.flatnonzero(
        solve_increment(ContactProblem.of(before, free, compliance, ContactLaw(Coulomb(0.3)), 1.0)).state.force[:, 0]
    )
    for i, j, a, b in ((0, -1, 0, 0), (1, 2, 1, 2), (-1, 0, 2, 0)):
        bad = compliance.copy()
        bad[touching[i], a, touching[j], b] = bad[touching[j], b, touching[i], a] = value
        for state in (ContactState.at_rest(gap, 3), before):
            found = rule(ContactProblem.of(state, free, bad, ContactLaw(Coulomb(0.3)), 1.0))
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


def test_no_touch_no_force() -> None:
    compliance, gap, _ = states_3d()
    found = solve_increment(
        ContactProblem.of(
            ContactState.at_rest(gap, 3),
            np.column_stack([gap + 1.0, np.zeros((len(gap), 2))]),
            compliance,
            ContactLaw(Coulomb(0.3)),
            1.0,
        )
    )
    assert found.outcome.ok
    assert not found.state.force.any()
    assert (found.state.status == OPEN).all()
