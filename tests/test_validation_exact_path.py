"""The path from event to event: closed forms, many increments, independence of where it is divided, and its limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.accuracy.estimate import press_numbers
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import Plane
from tests.contact_cases import half_plane, violation
from tests.models import fig9, half_cylinder
from validation._exact_path import Event, exact_press, follow
from validation._increments import imbalance
from validation._press import under


def problem_of(compliance: np.ndarray, before: ContactState, motion: np.ndarray, mu: float) -> ContactProblem:
    """The increment in which the free motion changes by `motion` (c, 2)."""
    c, d = motion.shape
    free = np.column_stack([before.gap, before.tangential_displacement])
    free = free - (compliance.reshape(c * d, c * d) @ before.force.ravel()).reshape(c, d) + motion
    return ContactProblem.of(before, free, compliance, Coulomb(mu), 1.0)


def pressed_points(points: int = 12, depth: float = 1.0, slide: float = 0.0) -> tuple[ContactState, np.ndarray]:
    """Points of a half-plane below a parabola at rest, and the motion of the parabola."""
    x = np.linspace(-1.0, 1.1, points)
    return ContactState.at_rest(0.8 * x**2, 2), np.tile([-depth, -slide], (points, 1))


def largest_residual(events: list[Event]) -> float:
    return max(event.residual for event in events)


def test_one_point_sticks_slips_and_opens_as_its_closed_form_says() -> None:
    # compliance 1 along either direction, no coupling: n = depth, and it slips where the slide reaches mu n
    compliance = np.eye(2).reshape(1, 2, 1, 2)
    start = ContactState.at_rest(np.array([0.5]), 2)
    down = follow(problem_of(compliance, start, np.array([[-2.5, 0.0]]), 0.5))
    assert [event.share for event in down] == pytest.approx([0.2, 1.0], abs=1e-15)
    assert down[-1].state.force[0] == pytest.approx([2.0, 0.0], abs=1e-14)
    events = follow(problem_of(compliance, down[-1].state, np.array([[0.0, -4.0]]), 0.5))
    slid = events[-1]
    assert [event.share for event in events] == pytest.approx([0.25, 1.0], abs=1e-14)
    assert [int(event.state.status[0]) for event in events] == [STICK, SLIP]
    assert slid.state.force[0] == pytest.approx([2.0, 1.0], abs=1e-14)
    assert slid.state.accumulated_slip[0] == pytest.approx(-3.0, abs=1e-14)
    lifted = follow(problem_of(compliance, slid.state, np.array([[4.0, 0.0]]), 0.5))[-1]
    assert lifted.state.status[0] == OPEN
    assert lifted.state.gap[0] == pytest.approx(2.0, abs=1e-14)


@pytest.mark.parametrize(("beta", "mu", "slide"), [(0.3, 0.5, 0.0), (0.5, 0.05, 0.4), (0.5, 1.0, 0.4)])
def test_increments_converge_to_the_path_at_first_order(beta: float, mu: float, slide: float) -> None:
    compliance = half_plane(12, 2, beta, spacing=0.2)
    start, motion = pressed_points(slide=slide)
    events = follow(problem_of(compliance, start, motion, mu))
    exact = events[-1]
    assert largest_residual(events) <= 1e-12
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
    state, motion = pressed_points(slide=0.3)
    events = follow(problem_of(compliance, state, motion, 0.3))
    assert {STICK, SLIP, OPEN} == {int(status) for event in events for status in event.state.status}
    for event in events:
        free = np.column_stack([state.gap * 0.0, state.tangential_displacement * 0.0])
        start, _ = pressed_points()
        free[:, 0] = start.gap
        free += event.share * motion
        assert violation(state, event.state, free, compliance, 0.3) < 1e-12
        state = event.state


@pytest.mark.parametrize("mu", [0.3, 2.0])
def test_the_end_does_not_depend_on_where_the_path_is_divided(mu: float) -> None:
    compliance = half_plane(12, 2, 0.4, spacing=0.2)
    start, motion = pressed_points(slide=0.3)
    whole = follow(problem_of(compliance, start, motion, mu))[-1]
    state = start
    for share in (0.13, 0.4, 0.07, 0.4):
        state = follow(problem_of(compliance, state, share * motion, mu))[-1].state
    assert state.force == pytest.approx(whole.state.force, abs=1e-13)
    assert state.accumulated_slip == pytest.approx(whole.state.accumulated_slip, abs=1e-13)


def test_points_that_touch_together_are_one_event() -> None:
    compliance = half_plane(11, 2, 0.4, spacing=0.2)
    start = ContactState.at_rest(np.full(11, 0.1), 2)
    events = follow(problem_of(compliance, start, np.tile([-1.0, 0.0], (11, 1)), 0.3))
    found = events[-1]
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
        state = follow(problem_of(compliance, state, np.array([motion]), 3.0))[-1].state
    assert state.force[0] == pytest.approx([6.0, 5.8], abs=1e-12)
    events = follow(problem_of(compliance, state, np.array([[4.0, 0.0]]), 3.0))
    assert largest_residual(events) <= 1e-12
    stuck, jumped, end = events
    assert stuck.share * 4.0 == pytest.approx((3.0 * 6.0 - 5.8) / (3.0 * 2.0 - 0.8), abs=1e-12)
    assert jumped.share == pytest.approx(stuck.share, abs=1e-8)
    assert [int(event.state.status[0]) for event in (jumped, end)] == [OPEN, OPEN]
    assert not jumped.state.force.any()


PATHS = {
    "press": (Leg(8.0, steps=1),),
    "slide": (Leg(8.0, steps=1), Leg(8.0, slide_x_mm=1.0, steps=1), Leg(3.0, slide_x_mm=-0.5, steps=1)),
}


@pytest.mark.parametrize(("name", "mu", "nu"), [("press", 0.06, 0.5), ("slide", 0.06, 0.5), ("slide", 1.0, 0.0)])
def test_no_number_depends_on_the_steps(name: str, mu: float, nu: float) -> None:
    model = fig9(
        domain="plane-strain", mesh=MeshOptions(4.0, 10.0), symmetry=(), friction=Coulomb(mu),
        material=Isotropic(1.0, nu), object=Plane(tilt=np.deg2rad(2.0)),
    )  # fmt: skip
    problem, ends = build(model), []
    for steps in (1, 7):
        legs = tuple(replace(leg, steps=steps) for leg in PATHS[name])
        found = exact_press(replace(problem, model=replace(model, legs=legs)))
        assert max(step.residual for step in found) <= 1e-12
        ends.append(found[-1])
    one, other = ends
    assert press_numbers(problem, one) == pytest.approx(press_numbers(problem, other), rel=1e-9, abs=1e-9)
    assert abs(imbalance(problem, one)) <= 1e-9


def test_increments_approach_the_path_at_second_order() -> None:
    legs = PATHS["slide"]
    problem = build(fig9(domain="plane-strain", mesh=MeshOptions(4.0, 10.0), legs=legs, friction=Coulomb(0.15)))
    exact = exact_press(problem)[-1]
    errors = []
    for steps in (20, 160):
        end = under(problem, Coulomb(0.15), steps)[-1]
        errors.append(np.abs(end.meshed_state.contact.force - exact.meshed_state.contact.force).max())
    assert np.log(errors[0] / errors[1]) / np.log(8.0) > 1.6  # points close one by one


def test_the_half_cylinder_of_the_paper_has_the_reference_values() -> None:
    # validation/REFERENCES.md, the paper's half cylinder in plane stress: a fine mesh, 100 increments; ours is coarser
    problem = build(replace(half_cylinder(0.1), material=Isotropic(1.0, 0.3), domain="plane-stress"))
    numbers = measure(problem.points, list(march(problem))[-1])
    width = 2.0 * problem.points.half_width_mm
    assert numbers["normal_force_N"] / width == pytest.approx(1.01932, rel=5e-3)
    assert numbers["contact_half_length_mm"] == pytest.approx(2.297, abs=0.05)
    assert numbers["stick_half_length_mm"] == pytest.approx(2.230, abs=0.1)


@pytest.mark.parametrize(("size", "nu", "mu", "end"), [(6.0, 0.49, 100.0, (9.5, 27)), (4.0, 0.0, 1e6, (0.0, 200))])
def test_a_path_goes_on_where_forces_jump_again_and_again(
    size: float, nu: float, mu: float, end: tuple[float, int]
) -> None:
    # held by much friction and lifted, forces jump within each part of the path, however short
    legs = (Leg(10.0, steps=1), Leg(10.0, slide_x_mm=3.0, steps=1), Leg(end[0], slide_x_mm=3.0, steps=end[1]))
    changes = {"material": Isotropic(1.0, nu), "mesh": MeshOptions(size, 4.0 * size), "friction": Coulomb(mu)}
    problem = build(fig9(domain="plane-strain", legs=legs, **changes))
    steps = exact_press(problem)
    assert len(steps) == 2 + end[1]
    for contact in (step.meshed_state.contact for step in steps):
        assert not contact.force[contact.status == OPEN].any()  # no result lies within an increment over a jump
    assert sum(step.iterations for step in steps) < 1000
    assert abs(imbalance(problem, steps[-1])) <= 1e-9
