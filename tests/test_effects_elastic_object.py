"""An object that yields: non-matching surfaces, action and reaction, equal bodies, every shape's body, symmetry."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects import elastic_object
from finger3d.effects.elastic_object import Effect
from finger3d.errors import Finger3dError
from finger3d.fem.material import Isotropic
from finger3d.fem.simplex import Mesh, reflected, signed_volumes
from finger3d.fem.traces import surface
from finger3d.fem.transfer import facing_trace, values_over
from finger3d.geometry.registry import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.history import measure
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.swept import mesh_section
from finger3d.objects import Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave, Wedge
from finger3d.scene import parse
from tests.bodies import ball
from tests.models import last, run

DESIGNS = designs()
SHAPES: list[RigidObject] = [
    Plane(), Plane(tilt=0.05), Cylinder(radius_mm=4.0), Cylinder(0.3, radius_mm=4.0), Cylinder(radius_mm=4.0, axis="x"),
    Wedge(angle=0.2, tip_radius_mm=1.0), Wave(wavelength_mm=3.0, amplitude_mm=0.1),
    Wave(wavelength_mm=3.0, amplitude_mm=0.1, axis="x"),
]  # fmt: skip


def pad(**changes: Any) -> Model:
    body = DESIGNS["block"](half_length_mm=4.0, height_mm=3.0, width_mm=6.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(0.6, 1.2, "swept"), (Leg(0.3, steps=2),), friction=Coulomb(0.3)
    )  # fmt: skip
    return replace(model, **changes)


def faced(dim: int) -> tuple[Mesh, Mesh]:
    """A block's mesh, and another, finer one of a round body upside down over it."""
    block = DESIGNS["block"](half_length_mm=3.0, height_mm=2.0, width_mm=4.0)
    round_ = DESIGNS["half_cylinder"](radius_mm=5.0, width_mm=4.0)
    make = mesh_solid if dim == 3 else mesh_section
    below = make(block, MeshOptions(0.7, 1.0, "swept"), (-1.0, 1.0, -2.0, 2.0))[0]
    above = make(round_, MeshOptions(0.45, 1.0, "swept"), (-1.0, 1.0, -2.0, 2.0))[0]
    return below, reflected(above, 1)


@pytest.mark.parametrize("dim", [2, 3])
def test_fields_are_read_over_the_points_though_meshes_do_not_match(dim: int) -> None:
    below, above = faced(dim)
    assert (signed_volumes(above) > 0.0).all()
    face = surface(below, "contact")
    values, there = values_over(above, "contact", face.samples)
    assert there.all()
    across = [0] if dim == 2 else [0, 2]
    # the place itself, curved facets included, and a linear field
    np.testing.assert_allclose(values @ above.points[:, across], face.samples[:, across], atol=1e-10)
    height = values @ above.points[:, 1]
    np.testing.assert_allclose(height, -np.sqrt(25.0 - face.samples[:, 0] ** 2), atol=1e-4)
    trace = facing_trace(face, above, "contact")
    assert np.abs(trace @ np.ones(len(above.points)) - 1.0).max() < 1e-12


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_reach_the_object_undiminished(dim: int) -> None:
    below, above = faced(dim)
    face = surface(below, "contact")
    trace = facing_trace(face, above, "contact")
    force = np.random.default_rng(0).normal(size=(len(face.nodes), dim))
    reached = trace.T @ force
    assert np.abs(reached.sum(axis=0) - force.sum(axis=0)).max() < 1e-10 * np.abs(force).sum()
    # and their moment, as far as samples stand for the hats
    across = np.cross(face.points, force) if dim == 3 else face.points[:, 0] * force[:, 1]
    moment = np.cross(above.points * [1, 0, 1], reached * [0, 1, 0]) if dim == 3 else above.points[:, 0] * reached[:, 1]
    samples = face.average @ face.samples
    wanted = np.cross(samples * [1, 0, 1], force * [0, 1, 0]) if dim == 3 else samples[:, 0] * force[:, 1]
    assert np.abs(moment.sum(axis=0) - wanted.sum(axis=0)).max() < 1e-9 * np.abs(across).sum()


def test_points_with_nothing_over_them_get_no_object() -> None:
    below, _ = faced(2)
    narrow = DESIGNS["half_cylinder"](radius_mm=1.0, width_mm=4.0)
    above = reflected(mesh_section(narrow, MeshOptions(0.3, 0.5), (-1.0, 1.0, -2.0, 2.0))[0], 1)
    face = surface(below, "contact")
    rows = np.asarray(facing_trace(face, above, "contact").sum(axis=1)).ravel()
    inside = np.abs(face.points[:, 0]) < 0.5
    outside = np.abs(face.points[:, 0]) > 1.5
    assert np.abs(rows[inside] - 1.0).max() < 1e-12
    assert np.abs(rows[outside]).max() == 0.0


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
    finger = DESIGNS["half_cylinder"](radius_mm=5.0, width_mm=2.0)
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
    part = problem.upright_force(frames[-1].part)
    stored = 0.5 * 4.0 * np.einsum("id,idje,je->", part, problem.delassus, part)
    assert frames[-1].external_work_mJ == pytest.approx(stored, rel=1e-10)


def half_ball(radius: float) -> Triangles:
    """The lower half of a ball, closed by a level lid."""
    whole = ball(radius, 28, 56)
    keep = whole.corners[:, :, 1].max(axis=1) <= 1e-9
    rim = np.flatnonzero(np.abs(whole.points[:, 1]) < 1e-9)
    rim = rim[np.argsort(np.arctan2(whole.points[rim, 2], whole.points[rim, 0]))]
    lid = np.stack([np.full(len(rim), len(whole.points)), np.roll(rim, -1), rim], axis=1)
    return Triangles(np.vstack([whole.points, [[0.0, 0.0, 0.0]]]), np.vstack([whole.faces[keep], lid]))


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


def test_what_the_settings_refuse() -> None:
    for obj in (Sphere(radius_mm=4.0), Cylinder(radius_mm=4.0), MeshObject(surface=half_ball(4.0))):
        with pytest.raises(Finger3dError, match=r"effects\.elastic_object\.height_mm: only for a plane, wedge or wave"):
            Effect(1.0, 0.3, 5.0).apply(pad(object=obj))
    with pytest.raises(Finger3dError, match='has no section; set model.domain = "solid"'):
        Effect(1.0, 0.3).apply(pad(object=MeshObject(surface=half_ball(4.0)), domain="plane-strain"))
    slid = Effect(1.0, 0.3).apply(pad(legs=(Leg(0.3, slide_x_mm=1.0),)))
    assert any("its compliance stays" in w for w in slid.warnings)


def test_a_scene_names_the_effect() -> None:
    tables = {
        "finger": {"geometry": "block", "half_length_mm": 4.0, "height_mm": 3.0, "width_mm": 6.0},
        "material": {"E_MPa": 1.0, "nu": 0.3},
        "press": {"depth_mm": 0.3},
        "effects": {"elastic_object": {"E_MPa": 10.0, "nu": 0.4}},
    }
    model = parse(tables).model()
    assert model.object_compliance == elastic_object.SoftObject(10.0, 0.4, None)
    for key, value, text in (
        ("nu", 0.6, "from 0 to 0.5"),
        ("E_MPa", 0.0, "from 1e-9 to 1e9"),
        ("height_mm", -1.0, "from 1e-6 to 1e6"),
    ):
        bad = {**tables, "effects": {"elastic_object": {"E_MPa": 10.0, "nu": 0.4, key: value}}}
        with pytest.raises(Finger3dError, match=text):
            parse(bad)
