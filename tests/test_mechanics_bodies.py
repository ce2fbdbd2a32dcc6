"""Condensed bodies: contact points, symmetry, meshes that move with a design, elastic objects."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.elastic_object import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import Mesh, curved_volume, quadratic
from finger3d.fem.surface import BoundarySurface, surface
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.body_mesh import stretched
from finger3d.mechanics.discretise.build import build, mesh_part
from finger3d.mechanics.discretise.contact_points import contact_geometry
from finger3d.mechanics.discretise.resolution import regular_points
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Gauge, Leg, MeshOptions, Model
from finger3d.objects import Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave, Wedge
from tests.meshes import grid, part_volume
from tests.models import block, fig9, last, run
from tests.soft_object_cases import half_ball, pad
from validation._increments import imbalance


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
def test_quarter_and_whole_model_agree_on_a_mirrored_mesh(nu: float) -> None:
    quarter, whole = (block(material=Isotropic(1.0, nu), symmetry=axes) for axes in (("x", "z"), ()))
    (p, f), (q, g) = run(quarter), run(whole)
    a, b = measure(p.points, f[-1]), measure(q.points, g[-1])
    assert (p.axes, q.axes) == (("x", "z"), ())
    for key in ("normal_force_N", "friction_sum_N", "contact_area_mm2", "dissipation_mJ", "external_work_mJ"):
        # the dissipation of few points that slip is known as well as the work, of which it is a small share
        assert a[key] == pytest.approx(b[key], rel=1e-8, abs=1e-9 * b["external_work_mJ"])
    assert abs(b["tangential_force_x_N"]) < 1e-10 * b["normal_force_N"]
    order_a, order_b = (np.lexsort(np.round(r.points.points, 9).T) for r in (p, q))
    assert np.abs(f[-1].state.force[order_a] - g[-1].state.force[order_b]).max() < 1e-9


def test_solvers_behind_the_same_interface_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    a = last(block())
    monkeypatch.setenv("FINGER3D_SOLVER", "superlu")
    b = last(block())
    assert b["normal_force_N"] == pytest.approx(a["normal_force_N"], rel=1e-11)


COARSE = MeshOptions(1.5, 1.5, "swept")


def test_forces_on_the_whole_finger_are_those_of_the_part_and_its_images() -> None:
    problem, frames = run(block(mesh=COARSE, gauges=(Gauge("g", 1.0, 1.5),)))
    state = frames[-1].meshed_state.contact
    assert problem.axes == ("x", "z")
    whole = problem.world_force(state)
    # friction of mirror images cancels, pressure adds up
    assert whole.sum(axis=0) == pytest.approx([0.0, 4.0 * state.scene_force[:, 1].sum(), 0.0], abs=1e-12)
    # a reading by its row, and by the field
    force = problem.upright_force(state)
    (row,) = (gauge.rows(problem.meshed_body) for gauge in problem.model.gauges)
    (reading,) = problem.read(force).values()
    assert reading == pytest.approx((row @ problem.unknowns(force)[: row.shape[1]]).item(), rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "axes"),
    [
        ({}, ("x", "z")),
        ({"domain": "plane-strain"}, ("x",)),
        ({"legs": (Leg(0.3, slide_x_mm=0.1),)}, ("z",)),
        ({"legs": (Leg(0.3, slide_z_mm=0.1),)}, ("x",)),
        ({"object": Sphere(radius_mm=4.0, x_mm=0.5)}, ("z",)),
        ({"object": Plane(tilt=0.1)}, ("z",)),
        ({"symmetry": ()}, ()),
    ],
)
def test_planes_are_those_of_body_object_and_path(changes: dict[str, object], axes: tuple[str, ...]) -> None:
    assert symmetry(block(**changes)) == axes


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_the_whole_finger_is_the_part_and_its_mirror_images(domain: Domain) -> None:
    problem = build(block(domain=domain))
    frame = list(march(problem))[-1]
    points, whole = problem.points.points, frame.state
    assert np.sum(whole.force[:, 0]) == pytest.approx(problem.symmetry.total(frame.meshed_state.contact.force[:, 0]))
    assert problem.symmetry.total(problem.surface.area) == pytest.approx(problem.points.area.sum())
    at = {tuple(np.round(p, 9)): i for i, p in enumerate(points)}
    mirrored = [at[tuple(np.round(p * [-1.0, 1.0, 1.0], 9) + 0.0)] for p in points]
    assert whole.force[mirrored, 0] == pytest.approx(whole.force[:, 0])
    assert whole.force[mirrored, 1] == pytest.approx(-whole.force[:, 1])
    assert (whole.status[mirrored] == whole.status).all()


def top(dim: int) -> BoundarySurface:
    return surface(quadratic(grid((4,) * dim)), "y+")


@pytest.mark.parametrize("dim", [2, 3])
def test_the_gap_to_a_plane_is_exact_wherever_the_points_go(dim: int) -> None:
    face, rng = top(dim), np.random.default_rng(0)
    normal = np.eye(dim)[0] * 0.6 - np.eye(dim)[1] * 0.8
    moved = rng.normal(size=face.points.shape)
    made = contact_geometry(lambda at: (at @ normal + 1.2, np.tile(normal, (len(at), 1))), face, moved)
    assert made.gap == pytest.approx((face.centroids + moved) @ normal + 1.2, rel=1e-12)
    assert np.allclose(made.bases[:, 0], normal)
    assert np.allclose(made.gradient, normal)


def test_the_normal_of_a_ball_is_the_mean_direction_to_its_centre() -> None:
    face, centre, radius = top(3), np.array([0.5, 3.0, 0.5]), 1.5

    def ball(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        out = at - centre
        distance = np.linalg.norm(out, axis=1)
        return distance - radius, out / distance[:, None]

    made = contact_geometry(ball, face)
    wanted = face.centroids - centre
    wanted /= np.linalg.norm(wanted, axis=1)[:, None]
    # hats are 0.25 mm to each side, and the ball is 2 mm away: the mean is off by the square of their ratio
    assert made.bases[:, 0] == pytest.approx(wanted, abs=0.25**2 / 2.0**2)
    assert (made.slope < 1.0).all()
    assert made.angles(made) == pytest.approx(np.zeros(len(wanted)))


def test_an_object_as_soft_as_the_finger_meets_it_half_way() -> None:
    face, tilt = top(2), 0.2
    normal = np.array([np.sin(tilt), -np.cos(tilt)])
    made = contact_geometry(
        lambda at: (at @ normal, np.tile(normal, (len(at), 1))), face, object_share=np.full(len(face.points), 0.5)
    )
    assert np.allclose(made.bases[:, 0], [np.sin(tilt / 2.0), -np.cos(tilt / 2.0)])


def test_points_have_the_distance_asked_for_and_lie_on_the_surface() -> None:
    points = regular_points(fig9(), (-10.0, 10.0, -4.0, 4.0), 2.0)
    x, z = np.unique(points.points[:, 0]), np.unique(points.points[:, 2])
    assert np.diff(x) == pytest.approx(np.full(len(x) - 1, 2.0))
    assert np.diff(z) == pytest.approx(np.full(len(z) - 1, 2.0))
    assert x.min() <= -10.0 <= 10.0 <= x.max()
    # the circle of radius 100 mm through the top at 50 mm
    height = 36.6 + np.sqrt(100.0**2 - points.points[:, 0] ** 2) - np.sqrt(100.0**2 - 50.0**2)
    assert points.points[:, 1] == pytest.approx(height, rel=1e-12)


CLIPPED = designs()["clipped_cylinder"](radius_mm=6.0, half_length_mm=4.0, edge_height_mm=2.0, width_mm=4.0)
FINGERTIP = designs()["fingertip"](
    radius_mm=6.0, half_length_mm=4.0, edge_height_mm=3.0, width_mm=4.0, skin_mm=1.0, core_half_length_mm=1.5,
    core_height_mm=1.2,
)  # fmt: skip
PARTS = (("skin", Isotropic(2.0, 0.3)), ("core", Isotropic(5.0, 0.3)))
SLIDE = (Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.05, steps=2))
UNSTRUCTURED = Model(
    CLIPPED, Isotropic(1.0, 0.3), MeshOptions(1.0, 1.6, "ftetwild"), SLIDE, object=Plane(tilt=0.03), symmetry=(),
    friction=Coulomb(0.3), gauges=(Gauge("g", 0.7, 2.1, 0.2, 0.5),),
)  # fmt: skip


def with_dimension(model: Model, name: str, change: float) -> Model:
    return replace(model, design=replace(model.design, **{name: getattr(model.design, name) + change}))


def test_an_unstructured_mesh_stretches_with_the_dimensions() -> None:
    design = FINGERTIP
    model = replace(UNSTRUCTURED, design=design, parts=PARTS if design.part_labels else ())
    mesh = build(model).mesh
    for name in design.dimensions:
        ends = [stretched(mesh, design, with_dimension(model, name, t).design) for t in (-1e-4, 1e-4)]
        growth = (curved_volume(ends[1]) - curved_volume(ends[0])) / curved_volume(mesh)
        wanted = [with_dimension(model, name, t).design.volume_mm3 / design.volume_mm3 for t in (-1e-4, 1e-4)]
        assert growth == pytest.approx(wanted[1] - wanted[0], rel=0.05, abs=1e-9), name  # facets cut off the round


@pytest.mark.parametrize("name", ["radius_mm", "width_mm"])
def test_a_stretched_mesh_is_that_of_the_other_design(name: str) -> None:
    problem = build(replace(UNSTRUCTURED, mesh=MeshOptions(0.8, 1.2, "swept")))
    other = with_dimension(problem.model, name, 0.1).design
    mesh = stretched(problem.mesh, CLIPPED, other)
    x, y, z = mesh.points[np.unique(mesh.facets["contact"])].T
    assert y == pytest.approx(other.top(x, z), abs=1e-8)
    corner = [other.half_length_mm, other.height_mm, 0.5 * other.width_mm]
    assert np.abs(mesh.points).max(axis=0) == pytest.approx(corner, rel=1e-6)
    assert curved_volume(mesh) == pytest.approx(other.volume_mm3, rel=1e-4)


@pytest.mark.parametrize("name", ["radius_mm", "skin_mm", "core_height_mm"])
def test_parts_follow_the_section_of_a_body(name: str) -> None:
    model = replace(UNSTRUCTURED, design=FINGERTIP, parts=PARTS, mesh=MeshOptions(0.8, 1.2, "swept"))
    other = with_dimension(model, name, 1e-4)
    before, wanted = (mesh_part(one, model.first_contact.contact_box, ())[0] for one in (model, other))
    found = stretched(before, FINGERTIP, other.design)

    def changes(after: Mesh) -> list[float]:
        return [part_volume(after, part) / part_volume(before, part) - 1.0 for part in range(3)]

    # the arcs of the swept mesh are less fine than those of the section
    assert changes(found) == pytest.approx(changes(wanted), rel=1e-3, abs=1e-9)


SHAPES: list[RigidObject] = [
    Plane(tilt=0.05), Cylinder(0.3, radius_mm=4.0), Cylinder(radius_mm=4.0, axis="x"),
    Wedge(angle=0.2, tip_radius_mm=1.0), Wave(wavelength_mm=3.0, amplitude_mm=0.1),
]  # fmt: skip


@pytest.mark.parametrize("obj", SHAPES, ids=lambda o: f"{type(o).__name__} {getattr(o, 'axis', '')}")
@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
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


@pytest.mark.parametrize("obj", [Cylinder(radius_mm=4.0, axis="x"), Plane()])
def test_quarter_and_whole_agree(obj: RigidObject) -> None:
    model = Effect(1.0, 0.49).apply(pad(object=obj))
    a, b = last(replace(model, symmetry=("x", "z"))), last(replace(model, symmetry=()))
    for key in ("normal_force_N", "friction_sum_N", "contact_area_mm2", "external_work_mJ"):
        assert a[key] == pytest.approx(b[key], rel=1e-8)


def test_energy_goes_into_both_bodies() -> None:
    problem, frames = run(
        Effect(1.0, 0.3).apply(pad(object=Cylinder(radius_mm=4.0), friction=Coulomb(0.0), legs=(Leg(0.3, steps=20),)))
    )
    assert abs(imbalance(problem, frames[-1])) < 1e-10


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
