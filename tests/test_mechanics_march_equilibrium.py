"""Tangential forces that are prescribed: the slides follow, the whole contact slips at its limit, nothing creeps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.kinetic_friction import Effect as KineticFriction
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Leg
from finger3d.mechanics.results.history import measure
from finger3d.objects import Plane, Sphere
from tests.held_cases import MU, PRESS, N, held, numbers, pressed
from tests.models import block, marched


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


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_a_held_force_does_not_creep(domain: str) -> None:
    found = numbers(block(object=Plane(), domain=domain, legs=(PRESS, held(0.03), held(0.03, steps=100))))
    slides = np.array([step["slide_x_mm"] for step in found[3:]])
    assert np.abs(slides - slides[0]).max() <= 1e-12


def test_a_slide_after_a_force_begins_where_the_force_led() -> None:
    found = numbers(
        block(object=Plane(), legs=(Leg(0.2, steps=1), Leg(0.2, steps=1, force_x_N=0.2), Leg(0.2, steps=4)))
    )
    slides = [step["slide_x_mm"] for step in found[1:]]
    assert slides[0] > 0.0
    assert np.diff(slides) == pytest.approx(np.full(4, -0.25 * slides[0]))
