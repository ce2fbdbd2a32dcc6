"""Tangential forces that are prescribed: the slides follow, the whole contact slips at its limit, nothing creeps."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import STICK, Coulomb
from finger3d.effects.kinetic_friction import Effect as KineticFriction
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.errors import Outcome
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.generalised import forces_on
from finger3d.mechanics.march.parts import solved_in_turn
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.mechanics.results.state import State
from finger3d.objects import Cylinder, Move, Plane, Sphere
from tests.held_cases import MU, PRESS, N, held, numbers, pressed
from tests.models import block, marched
from validation import cattaneo_mindlin, held_weights


@pytest.mark.parametrize("shape", [Plane(), Sphere(radius_mm=4.0)], ids=["plane", "ball"])
def test_a_press_by_the_slides_found_has_the_same_forces(shape: Plane | Sphere) -> None:
    problem = build(block(object=shape, legs=(PRESS, held(0.02, 0.03), held(-0.01, 0.0))))
    by_force = [measure(problem.points, step) for step in marched(problem)]
    for k, share in enumerate((0.5, 1.0), start=2):
        assert by_force[k]["force_x_N"] == pytest.approx(share * 0.02, abs=1e-11 * N)
        assert by_force[k]["force_z_N"] == pytest.approx(share * 0.03, abs=1e-11 * N)
        assert by_force[k]["normal_force_N"] == pytest.approx(N, rel=1e-10)
    slides = [(step["depth_mm"], step["slide_x_mm"], step["slide_z_mm"]) for step in by_force]
    legs = tuple(Leg(*place, steps=1) for place in slides)
    by_slides = [
        measure(problem.points, step) for step in marched(replace(problem, model=replace(problem.model, legs=legs)))
    ]
    for one, other in zip(by_force[2:], by_slides[2:], strict=True):
        for key in ("normal_force_N", "force_x_N", "force_z_N", "moment_y_Nmm", "friction_sum_N"):
            assert one[key] == pytest.approx(other[key], abs=1e-8 * N)


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_a_flat_contact_slips_as_a_whole_at_mu_times_the_normal_force(domain: str) -> None:
    held_at, asked = held((1.0 - 1e-6) * MU * N), (1.0 + 1e-6) * MU * N
    flat = block(object=Plane(), domain=domain, legs=(PRESS, held_at))
    assert numbers(flat)[-1]["force_x_N"] == pytest.approx(MU * N, rel=2e-6)
    steps, _ = pressed(replace(flat, legs=(PRESS, held(asked))))
    assert [step.outcome.ok for step in steps] == [True, True, True, False]
    assert steps[-1].outcome is Outcome.SLIPS
    assert steps[-1].detail == f"{asked:.6g} N asked; the contact holds at most {MU * N:.9g} N, 100 % of it"


def test_a_slope_steeper_than_friction_holds_nothing_as_small_as_is_asked() -> None:
    # tan(20 deg - atan mu) = .105 and tan(20 deg + atan mu) = .673 times the normal force are the least and the most
    finger = block(
        design=designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0), mesh=MeshOptions(0.4, 1.6),
        object=Plane(tilt=np.radians(-20.0)), domain="plane-strain", legs=(PRESS, held(0.05 * N)),
    )  # fmt: skip
    steps, _ = pressed(finger)
    assert steps[-1].outcome is Outcome.SLIPS
    assert steps[-1].detail.endswith("but slides down its slope under less")


@pytest.mark.parametrize("steps", [1, 2])
def test_a_slope_without_friction_pushes_one_way(steps: int) -> None:
    finger = block(
        design=designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0), mesh=MeshOptions(0.4, 1.6),
        object=Plane(tilt=np.radians(-2.0)), friction=Coulomb(0.0), domain="plane-strain",
        legs=(Leg(0.5, steps=2), Leg(0.5, steps=steps, force_x_N=0.02)),
    )  # fmt: skip
    problem = build(finger)
    *_, before, last = march(problem)
    assert last.outcome in (Outcome.NOT_HELD, Outcome.SLIPS)
    assert before.outcome.ok
    assert measure(problem.points, before)["force_x_N"] < 0.0


@pytest.mark.parametrize(("mu", "steps"), [(0.05, 1), (0.05, 4), (0.0, 2)])
def test_a_free_object_slides_off_a_slope_that_friction_does_not_hold(mu: float, steps: int) -> None:
    """It rests where mu is at least tan(20 deg) = .36."""
    finger = block(
        design=designs()["block"](half_length_mm=6.0, height_mm=8.0, width_mm=5.0), mesh=MeshOptions(0.5, 2.0),
        object=Plane(tilt=np.radians(20.0)), friction=Coulomb(mu), domain="plane-strain",
        legs=(Leg(0.4, steps=1), Leg(0.4, steps=steps, force_x_N=0.0)),
    )  # fmt: skip
    problem = build(finger)
    *_, last = march(problem)
    assert (last.outcome, last.detail) == (Outcome.NOT_HELD, "the object leaves the finger")
    rests = replace(problem, model=replace(finger, friction=Coulomb(0.5)))
    assert measure(problem.points, marched(rests)[-1])["normal_force_N"] > 0.1


def test_a_free_object_that_is_lifted_off_has_no_force() -> None:
    legs = (Leg(0.4, steps=1), Leg(0.0, steps=2, force_x_N=0.0))
    problem = build(block(object=Plane(), domain="plane-strain", legs=legs))
    assert [step.outcome.ok for step in marched(problem)] == [True, True, True]


def test_a_cylinder_beside_the_middle_of_a_smooth_block_does_not_rest() -> None:
    """The free end of the block yields more, and the object slides there: a finite force is missing everywhere."""
    finger = block(
        design=designs()["block"](half_length_mm=6.0, height_mm=8.0, width_mm=5.0), mesh=MeshOptions(1.0, 2.0),
        object=Cylinder(radius_mm=20.0), friction=Coulomb(0.0), domain="plane-strain",
        legs=(Leg(0.2, 3.0, steps=1), Leg(0.2, 3.0, steps=1, force_x_N=0.0)),
    )  # fmt: skip
    *_, last = march(build(finger))
    assert last.outcome is Outcome.NOT_HELD
    assert last.detail.startswith("the nearest forces differ by")


@pytest.mark.parametrize(
    ("mu", "load", "above"),
    [(0.54787, 1.87586820, 1e-4), (0.54787, 1.87586820, 5e-4), (0.83208941713423, 2.113585171, 2.10350688514e-5)],
)
def test_a_finger_holds_what_is_just_below_the_largest_force(mu: float, load: float, above: float) -> None:
    """Close to it the last point that sticks decides, and beyond it forces no longer tell the slide."""
    problem = held_weights.held("plane-strain", 2.0)
    steps = held_weights.pressed(problem, mu, held_weights.lifting((1.0 + above) * load / mu, load))
    assert [step.outcome.ok for step in steps] == [True] * 8
    assert measure(problem.points, steps[-1])["force_x_N"] == pytest.approx(-load, rel=1e-9)
    below = held_weights.pressed(problem, mu, held_weights.lifting((1.0 - above) * load / mu, load))
    assert below[-1].outcome is Outcome.SLIPS


def test_a_cylinder_held_by_forces_sticks_as_one_that_is_slid() -> None:
    """The problem of Cattaneo and Mindlin, whose stick zone `validation.cattaneo_mindlin` compares with theirs."""
    problem = cattaneo_mindlin.problem(10)
    depth, mu = cattaneo_mindlin.DEPTH, cattaneo_mindlin.MU
    legs = (Leg(depth, steps=3), Leg(depth, mu * depth, steps=4), Leg(depth, -mu * depth, steps=4))
    by_slide = _measured(problem, legs)
    assert 0.4 * mu < by_slide[-1][1]["force_x_N"] / -by_slide[-1][1]["normal_force_N"] < mu
    forces = [(found["normal_force_N"], found["force_x_N"]) for _, found in by_slide]
    press = [Leg(depth * (k + 1) / 3, steps=1) for k in range(3)]
    by_force = _measured(problem, (*press, *(Leg(depth, steps=1, force_N=n, force_x_N=x) for n, x in forces[3:])))
    for (one, found), (other, again) in zip(by_slide, by_force, strict=True):
        np.testing.assert_array_equal(one.state.status == STICK, other.state.status == STICK)
        np.testing.assert_allclose(other.state.force, one.state.force, rtol=0.0, atol=1e-8 * found["normal_force_N"])
        assert again["depth_mm"] == pytest.approx(found["depth_mm"], rel=1e-8)
        assert again["slide_x_mm"] == pytest.approx(found["slide_x_mm"], abs=1e-8 * mu * depth)
        assert again["stick_area_mm2"] == pytest.approx(found["stick_area_mm2"], rel=1e-8)
        assert again["dissipation_mJ"] == pytest.approx(found["dissipation_mJ"], rel=1e-8, abs=1e-12)


def _measured(problem: Problem, legs: tuple[Leg, ...]) -> list[tuple[StepResult, dict[str, float]]]:
    model = replace(problem.model, legs=legs, friction=Coulomb(cattaneo_mindlin.MU))
    steps = marched(replace(problem, model=model))
    return [(step, measure(problem.points, step)) for step in steps]


def test_a_resolved_ball_slips_at_mu_times_the_normal_force() -> None:
    """Within the square of the largest tilt a/R of the normals."""
    radius, force = 20.0, 0.5
    press = Leg(0.1, steps=1, force_N=force)
    shape = {"half_length_mm": 4.0, "height_mm": 3.0, "width_mm": 8.0}
    ball = block(
        design=designs()["block"](**shape), mesh=MeshOptions(0.5, 1.5, "swept"), object=Sphere(radius_mm=radius)
    )
    steps, found = pressed(replace(ball, legs=(press, replace(press, force_x_N=0.99 * MU * force, steps=2))))
    assert [step.outcome.ok for step in steps] == [True, True, True]
    tolerance = found[-1]["contact_area_mm2"] / np.pi / radius**2
    steps, _ = pressed(replace(ball, legs=(press, replace(press, force_x_N=1.01 * MU * force, steps=2))))
    assert steps[-1].outcome is Outcome.SLIPS
    told = float(steps[-1].detail.split("at most ")[1].split(" N")[0])
    assert told == pytest.approx(MU * force, rel=tolerance)
    assert tolerance < 0.01


def test_a_ball_slips_at_its_limit() -> None:
    ball = block(legs=(PRESS, replace(held(0.06), steps=6)))
    steps, found = pressed(ball)
    assert steps[-1].outcome is Outcome.SLIPS
    assert max(step["force_x_N"] for step in found) == pytest.approx(0.05, abs=0.011)


EFFECTS = {
    "large": LargeDeformation(),
    "viscous": Viscosity(((0.4, 1.0),)),
    "kinetic": KineticFriction(0.7, "keep"),
}


@pytest.mark.parametrize("name", EFFECTS)
def test_forces_are_held_with_an_effect(name: str) -> None:
    legs = (PRESS, held(0.02), held(0.02, steps=2, duration_s=3.0))
    found = numbers(EFFECTS[name].apply(block(legs=legs, friction=Coulomb(MU), domain="plane-strain")))
    assert [step["force_x_N"] for step in found[2:]] == pytest.approx([0.01, 0.02, 0.02, 0.02], rel=1e-6)
    assert [step["normal_force_N"] for step in found] == pytest.approx([0.1, 0.2, 0.2, 0.2, 0.2, 0.2], rel=1e-6)
    creep = found[-1]["slide_x_mm"] - found[3]["slide_x_mm"]
    assert creep > 1e-4 if name == "viscous" else abs(creep) < 1e-6


@pytest.mark.parametrize("large", [False, True])
def test_moments_are_held_by_the_turns_that_have_them(large: bool) -> None:
    """Three turns and two slides under as many moments and forces; pressed through the poses, these come again."""
    press = Leg(0.8, steps=2, force_N=1.0)
    held_by = replace(press, steps=1, force_x_N=0.05, force_z_N=0.05)
    legs = (press, replace(held_by, moment_x_Nmm=-0.2, moment_y_Nmm=0.05, moment_z_Nmm=0.3))
    model = block(legs=legs, friction=Coulomb(0.5))
    problem = build(LargeDeformation().apply(model) if large else model)
    steps = marched(problem)
    poses = [problem.origin, *(pose for step in steps for pose, _ in step.parts)]
    assert min(abs(turn) for turn in poses[-1].turns) > 1e-3
    formulation, wanted = formulation_of(problem.model), [1.0, 0.05, 0.05, -0.2, 0.05, 0.3]

    def forces(state: State[Any]) -> np.ndarray:
        return forces_on(problem, formulation.loads(problem, state, poses[-1]).forces, poses[-1])

    same = 1e-7 if large else 1e-9
    assert forces(steps[-1].meshed_state)[:6] == pytest.approx(wanted, abs=same)
    moves = [Move(start, end) for start, end in pairwise(poses)]
    again, _ = solved_in_turn(problem, formulation.workspace(), formulation.start(problem), moves, 0)
    assert forces(again.state)[:6] == pytest.approx(wanted, abs=2.0 * same)


def test_a_moment_beyond_what_the_contact_holds_is_an_outcome() -> None:
    """A plate on its edges holds no more than the normal force times the half length."""
    plate = block(object=Plane(), domain="plane-strain", legs=(PRESS, replace(PRESS, moment_z_Nmm=2.0 * N * 5.0)))
    *_, last = march(build(plate))
    assert last.outcome is Outcome.NOT_HELD


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_a_held_force_does_not_creep(domain: str) -> None:
    found = numbers(block(object=Plane(), domain=domain, legs=(PRESS, held(0.03), held(0.03, steps=100))))
    slides = np.array([step["slide_x_mm"] for step in found[3:]])
    assert np.abs(slides - slides[0]).max() <= 1e-12
    assert [step["iterations"] for step in found[5:]] == [0] * (len(found) - 5)


def test_a_slide_after_a_force_begins_where_the_force_led() -> None:
    found = numbers(
        block(object=Plane(), legs=(Leg(0.2, steps=1), Leg(0.2, steps=1, force_x_N=0.2), Leg(0.2, steps=4)))
    )
    slides = [step["slide_x_mm"] for step in found[1:]]
    assert slides[0] > 0.0
    assert np.diff(slides) == pytest.approx(np.full(4, -0.25 * slides[0]))
