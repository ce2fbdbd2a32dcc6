"""The path from event to event: closed forms, many increments, independence of where it is divided, and its limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact import events as path
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.events import Resultant, follow
from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.law import ContactLaw
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.errors import Outcome
from tests.contact_cases import half_plane, violation


def problem_of(compliance: np.ndarray, before: ContactState, motion: np.ndarray, mu: float) -> ContactProblem:
    """The increment in which the free motion changes by `motion` (c, 2)."""
    c, d = motion.shape
    free = np.column_stack([before.gap, before.tangential_displacement])
    free = free - (compliance.reshape(c * d, c * d) @ before.force.ravel()).reshape(c, d) + motion
    return ContactProblem.of(before, free, compliance, ContactLaw(Coulomb(mu)), 1.0)


def pressed(points: int = 12, depth: float = 1.0, slide: float = 0.0) -> tuple[ContactState, np.ndarray]:
    """Points of a half-plane below a parabola at rest, and the motion of the parabola."""
    x = np.linspace(-1.0, 1.1, points)
    return ContactState.at_rest(0.8 * x**2, 2), np.tile([-depth, -slide], (points, 1))


def test_one_point_sticks_slips_and_opens_as_its_closed_form_says() -> None:
    # compliance 1 along either direction, no coupling: n = depth, and it slips where the slide reaches mu n
    compliance = np.eye(2).reshape(1, 2, 1, 2)
    start = ContactState.at_rest(np.array([0.5]), 2)
    down = follow(problem_of(compliance, start, np.array([[-2.5, 0.0]]), 0.5))
    assert [event.share for event in down[1]] == pytest.approx([0.2, 1.0], abs=1e-15)
    assert down[0].state.force[0] == pytest.approx([2.0, 0.0], abs=1e-14)
    slid, events = follow(problem_of(compliance, down[0].state, np.array([[0.0, -4.0]]), 0.5))
    assert [event.share for event in events] == pytest.approx([0.25, 1.0], abs=1e-14)
    assert [int(event.state.status[0]) for event in events] == [STICK, SLIP]
    assert slid.state.force[0] == pytest.approx([2.0, 1.0], abs=1e-14)
    assert slid.state.accumulated_slip[0] == pytest.approx(-3.0, abs=1e-14)
    lifted, events = follow(problem_of(compliance, slid.state, np.array([[4.0, 0.0]]), 0.5))
    assert lifted.outcome.ok
    assert lifted.state.status[0] == OPEN
    assert lifted.state.gap[0] == pytest.approx(2.0, abs=1e-14)


@pytest.mark.parametrize(("beta", "mu"), [(0.0, 0.2), (0.3, 0.5), (0.5, 0.05), (0.5, 1.0)])
@pytest.mark.parametrize("slide", [0.0, 0.4])
def test_increments_converge_to_the_path_at_first_order(beta: float, mu: float, slide: float) -> None:
    compliance = half_plane(12, 2, beta, spacing=0.2)
    start, motion = pressed(slide=slide)
    exact, events = follow(problem_of(compliance, start, motion, mu))
    assert exact.outcome.ok
    assert exact.residual <= 1e-12
    errors = []
    for count in (40, 640):
        state = start
        for _ in range(count):
            state = solve_increment(problem_of(compliance, state, motion / count, mu)).state
        errors.append(np.abs(state.force - exact.state.force).max() / np.abs(exact.state.force).max())
    # 16 times as many increments, a sixteenth at first order; points close one by one, and without slip nothing is left
    assert errors[1] < max(errors[0] / 4.0, 1e-12)
    assert errors[1] < 0.01


def test_every_part_of_the_path_satisfies_the_contact_conditions() -> None:
    compliance = half_plane(12, 2, 0.4, spacing=0.2)
    state, motion = pressed(slide=0.3)
    _, events = follow(problem_of(compliance, state, motion, 0.3))
    assert {STICK, SLIP, OPEN} == {int(status) for event in events for status in event.state.status}
    for event in events:
        free = np.column_stack([state.gap * 0.0, state.tangential_displacement * 0.0])
        start, _ = pressed()
        free[:, 0] = start.gap
        free += event.share * motion
        assert violation(state, event.state, free, compliance, 0.3) < 1e-12
        state = event.state


@pytest.mark.parametrize("mu", [0.0, 0.3, 2.0])
def test_the_end_does_not_depend_on_where_the_path_is_divided(mu: float) -> None:
    compliance = half_plane(12, 2, 0.4, spacing=0.2)
    start, motion = pressed(slide=0.3)
    whole, _ = follow(problem_of(compliance, start, motion, mu))
    state = start
    for share in (0.13, 0.4, 0.07, 0.4):
        state = follow(problem_of(compliance, state, share * motion, mu))[0].state
    assert state.force == pytest.approx(whole.state.force, abs=1e-13)
    assert state.accumulated_slip == pytest.approx(whole.state.accumulated_slip, abs=1e-13)


def test_points_that_touch_together_are_one_event() -> None:
    compliance = half_plane(11, 2, 0.4, spacing=0.2)
    start = ContactState.at_rest(np.full(11, 0.1), 2)
    found, events = follow(problem_of(compliance, start, np.tile([-1.0, 0.0], (11, 1)), 0.3))
    assert found.outcome.ok
    assert events[0].share == pytest.approx(0.1, abs=1e-15)
    assert found.state.force[:, 0] == pytest.approx(found.state.force[::-1, 0], abs=1e-13)
    assert found.state.force[:, 1] == pytest.approx(-found.state.force[::-1, 1], abs=1e-13)


def test_a_point_that_can_neither_stick_nor_slip_snaps_off() -> None:
    # one point, unique up to mu = 1.25 (Klarbring 1990): n = 6 - 2 z and t = 5.8 - 0.8 z while it is lifted by z and
    # sticks, up to its limit t = 3 n; if it slipped there, its normal force would grow as it is lifted
    stiffness = np.array([[2.0, 0.8], [0.8, 1.0]])  # normal, tangential
    compliance = np.linalg.inv(stiffness).reshape(1, 2, 1, 2)
    state = ContactState.at_rest(np.zeros(1), 2)
    for motion in ([-1.0, 0.0], [0.0, -5.0]):
        state = follow(problem_of(compliance, state, np.array([motion]), 3.0))[0].state
    assert state.force[0] == pytest.approx([6.0, 5.8], abs=1e-12)
    found, events = follow(problem_of(compliance, state, np.array([[4.0, 0.0]]), 3.0))
    assert found.outcome.ok
    assert found.residual <= 1e-12
    stuck, jumped, end = events
    assert stuck.share * 4.0 == pytest.approx((3.0 * 6.0 - 5.8) / (3.0 * 2.0 - 0.8), abs=1e-12)
    assert jumped.share == pytest.approx(stuck.share, abs=1e-8)
    assert [int(event.state.status[0]) for event in (jumped, end)] == [OPEN, OPEN]
    assert not jumped.state.force.any()


def test_a_prescribed_resultant_determines_the_amplitude() -> None:
    compliance = half_plane(12, 2, 0.3, spacing=0.2)
    start, motion = pressed()
    by_depth, events = follow(problem_of(compliance, start, motion, 0.3))
    force = float(by_depth.state.force[:, 0].sum())
    weights = np.tile([1.0, 0.0], (12, 1))
    resultant = Resultant(weights, 0.0, force, motion, largest=3.0)
    found, events = follow(problem_of(compliance, start, np.zeros_like(motion), 0.3), resultant)
    assert found.outcome.ok
    assert events[-1].amplitude == pytest.approx(1.0, abs=1e-13)
    assert found.state.force == pytest.approx(by_depth.state.force, abs=1e-13)
    short = replace(resultant, end=2.0 * force, largest=1.1)
    refused, _ = follow(problem_of(compliance, start, np.zeros_like(motion), 0.3), short)
    assert refused.outcome is Outcome.FORCE_NOT_REACHED
    assert refused.state is start


def test_events_that_accumulate_are_an_outcome(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path, "_LEAST_EVENTS", 3)
    monkeypatch.setattr(path, "_EVENTS_A_POINT", 0)
    start, motion = pressed()
    found, _ = follow(problem_of(half_plane(12, 2, 0.3, spacing=0.2), start, motion, 0.3))
    assert found.outcome is Outcome.EVENTS
    assert found.state is start
