"""An object that yields: non-matching surfaces, action and reaction, equal bodies, every shape's body, symmetry."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.elastic_object import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave, Wedge
from tests.models import last, run
from tests.soft_object_cases import half_ball, pad

SHAPES: list[RigidObject] = [
    Plane(), Plane(tilt=0.05), Cylinder(radius_mm=4.0), Cylinder(0.3, radius_mm=4.0), Cylinder(radius_mm=4.0, axis="x"),
    Wedge(angle=0.2, tip_radius_mm=1.0), Wave(wavelength_mm=3.0, amplitude_mm=0.1),
    Wave(wavelength_mm=3.0, amplitude_mm=0.1, axis="x"),
]  # fmt: skip


@pytest.mark.parametrize("obj", SHAPES, ids=lambda o: f"{type(o).__name__} {getattr(o, 'axis', '')}")
@pytest.mark.parametrize("domain", ["plane-strain", "plane-stress", "solid"])
def test_a_stiff_object_is_the_rigid_one_and_a_soft_one_gives(obj: RigidObject, domain: Any) -> None:
    rigid = run(pad(object=obj, domain=domain))
    stiff = run(Effect(1e12, 0.3).apply(pad(object=obj, domain=domain)))
    force = [frames[-1].state.force for _, frames in (rigid, stiff)]
    assert np.abs(force[0] - force[1]).max() <= 1e-10 * np.abs(force[0]).max()
    assert stiff[0].factorizations == 2
    soft = last(Effect(1.0, 0.3).apply(pad(object=obj, domain=domain)))
    share = soft["normal_force_N"] / measure(rigid[0].points, rigid[1][-1])["normal_force_N"]
    assert 0.35 < share < 0.75  # about a half: as soft, and as thick


def test_equal_bodies_do_not_rub() -> None:
    finger = designs()["half_cylinder"](radius_mm=5.0, width_mm=2.0)
    plain = pad(
        design=finger, mesh=MeshOptions(0.2, 0.8, "swept"), domain="plane-strain", object=Cylinder(radius_mm=5.0),
        legs=(Leg(1.0, steps=4),),
    )  # fmt: skip
    equal = last(Effect(1.0, 0.3).apply(plain))
    # the surface of contact is the mean of both, one of facets and one of quadrature points
    assert equal["friction_sum_N"] < 2e-3 * equal["normal_force_N"]
    # the plane between two mirror images does not move: half the depth on a rigid, smooth one
    half = replace(plain, object=Plane(), legs=(Leg(0.5, steps=4),), friction=Coulomb(0.0))
    assert equal["normal_force_N"] == pytest.approx(last(half)["normal_force_N"], rel=1e-3)
    assert last(Effect(1.0, 0.45).apply(plain))["friction_sum_N"] > 5e-3 * equal["normal_force_N"]


def test_compliances_add_under_a_rigid_punch_of_uniform_pressure() -> None:
    # nu = 0, flat on flat: two bars in series, E A d / (h1 / E1 + h2 / E2)
    model = pad(material=Isotropic(1.0, 0.0), friction=Coulomb(0.0), object=Plane())
    got = last(Effect(2.0, 0.0, height_mm=5.0).apply(model))
    assert got["normal_force_N"] == pytest.approx(0.3 * 48.0 / (3.0 / 1.0 + 5.0 / 2.0), rel=1e-10)
    default = last(Effect(2.0, 0.0).apply(model))  # as thick as the finger
    assert default["normal_force_N"] == pytest.approx(0.3 * 48.0 / (3.0 / 1.0 + 3.0 / 2.0), rel=1e-10)


@pytest.mark.parametrize("obj", [Cylinder(radius_mm=4.0, axis="x"), Wedge(angle=0.2, tip_radius_mm=1.0), Plane()])
def test_quarter_and_whole_agree(obj: RigidObject) -> None:
    model = Effect(1.0, 0.49).apply(pad(object=obj))
    a, b = last(replace(model, symmetry=("x", "z"))), last(replace(model, symmetry=()))
    for key in ("normal_force_N", "friction_sum_N", "contact_area_mm2", "external_work_mJ"):
        assert a[key] == pytest.approx(b[key], rel=1e-8)


def test_energy_goes_into_both_bodies() -> None:
    problem, frames = run(
        Effect(1.0, 0.3).apply(pad(object=Cylinder(radius_mm=4.0), friction=Coulomb(0.0), legs=(Leg(0.3, steps=20),)))
    )
    part = problem.upright_force(frames[-1].meshed_state.contact)
    stored = 0.5 * 4.0 * np.einsum("id,idje,je->", part, problem.delassus, part)
    assert frames[-1].external_work_mJ == pytest.approx(stored, rel=1e-10)


@pytest.mark.slow
def test_half_a_ball_as_a_sphere_and_as_a_file() -> None:
    # One is meshed as a quarter from CAD, the other whole from triangles, which lie up to 25 um inside of the ball.
    options = MeshOptions(0.6, 2.0, "swept")
    legs = (Leg(0.4, steps=2),)
    sphere = last(Effect(1.0, 0.3).apply(pad(mesh=options, legs=legs, object=Sphere(radius_mm=4.0))))
    drawn = replace(half_ball(4.0), points=half_ball(4.0).points + [3.0, 1.0, -2.0])
    file = last(Effect(1.0, 0.3).apply(pad(mesh=options, legs=legs, object=MeshObject(surface=drawn))))
    assert file["normal_force_N"] == pytest.approx(sphere["normal_force_N"], rel=0.05)
    assert (
        0.35
        < file["normal_force_N"]
        / last(pad(mesh=options, legs=legs, object=MeshObject(surface=drawn)))["normal_force_N"]
        < 0.75
    )
