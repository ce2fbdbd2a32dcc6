"""Rigid objects: exact heights, where they touch first, approaches that are refused."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.solve import march
from finger3d.objects import (
    ContactPath,
    Cylinder,
    MeshObject,
    ObjectPose,
    PlacedObject,
    Plane,
    RigidObject,
    Sphere,
    Wave,
    Wedge,
    first_contact_height,
    initial_contact,
)
from tests.bodies import ball, box, channel

FIG9 = designs()["clipped_cylinder"](100.0, 50.0, 36.6, 20.0)
TOP = 36.6 + 100.0 - math.sqrt(100.0**2 - 50.0**2)
PRESS = ((10.0, 0.0, 0.0),)


def near(obj: RigidObject, path: Sequence[Sequence[float]] = PRESS, walls_touch: bool = True) -> float:
    poses = tuple(ObjectPose(*target) for target in path)
    way = ContactPath(FIG9.top, obj, 50.0, 10.0, poses, walls_touch=walls_touch)
    return initial_contact(way).first_contact_mm


# heights at (x, z) = (3, 4) above the lowest point at (0, 0), and one mm beside it along x
@pytest.mark.parametrize(
    ("obj", "far", "close"),
    [
        (Plane(tilt=0.3), 3.0 * math.tan(0.3), math.tan(0.3)),
        (Cylinder(radius_mm=10.0), 10.0 - math.sqrt(91.0), 10.0 - math.sqrt(99.0)),
        (Cylinder(radius_mm=10.0, axis="x"), 10.0 - math.sqrt(84.0), 0.0),
        (Sphere(radius_mm=10.0), 10.0 - math.sqrt(75.0), 10.0 - math.sqrt(99.0)),
        (Wedge(angle=0.5), 3.0 * math.tan(0.5), math.tan(0.5)),
        (Wedge(angle=0.5, tip_radius_mm=4.0), 4.0 - 4.0 / math.cos(0.5) + 3.0 * math.tan(0.5), 4.0 - math.sqrt(15.0)),
        (Wave(wavelength_mm=5.0, amplitude_mm=1.0), 1.0 - math.cos(1.2 * math.pi), 1.0 - math.cos(0.4 * math.pi)),
        (Wave(wavelength_mm=5.0, amplitude_mm=0.2, axis="x"), 0.2 - 0.2 * math.cos(1.6 * math.pi), 0.0),
    ],
)  # fmt: skip
def test_heights_in_closed_form(obj: RigidObject, far: float, close: float) -> None:
    height = obj.profile(np.array([0.0, 3.0, 1.0]), np.array([0.0, 4.0, 0.0]))
    np.testing.assert_allclose(height, [0.0, far, close], atol=1e-14)


@pytest.mark.parametrize(
    "obj",
    [Plane(), Sphere(radius_mm=20.0), Sphere(30.0, 4.0, radius_mm=20.0), Cylinder(radius_mm=5.0, axis="x"),
     Wedge(12.3, angle=0.4), Wave(1.7, wavelength_mm=4.0, amplitude_mm=0.5), Sphere(-17.77, 3.33, radius_mm=0.01)],
)  # fmt: skip
def test_first_touch_is_the_largest_overlap_of_the_real_surfaces(obj: RigidObject) -> None:
    touch = first_contact_height(FIG9.top, obj, 50.0, 10.0)
    x, z = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 200_000)) * [[50.0], [10.0]]
    tried = np.nan_to_num(FIG9.top(x, z) - PlacedObject.of(obj, 0.0).height(x, z), nan=-np.inf).max()
    assert tried <= touch + 1e-9
    if obj.x_mm == 0.0:
        assert touch == pytest.approx(TOP, abs=1e-9)
    if isinstance(obj, Sphere) and obj.x_mm == 30.0:  # two circles touch where their middles' line meets both
        assert touch == pytest.approx(TOP - 100.0 + math.sqrt(120.0**2 - 30.0**2) - 20.0, abs=1e-8)


def test_first_touch_by_search_not_by_bounding_box() -> None:
    # A channel over the dome touches with its roof, 20 mm above its lowest points.
    assert near(MeshObject(surface=channel(110.0, 20.0))) == pytest.approx(TOP - 20.0, abs=1e-9)
    # The ball's lowest vertex is not what touches off the middle.
    round_ball = MeshObject(30.0, surface=ball(20.0, 120, 240))
    assert near(round_ball) == pytest.approx(near(Sphere(30.0, radius_mm=20.0)), abs=5e-3)
    # The object's corner beside a flat top: a vertex against a face.
    block = designs()["block"](4.0, 3.0, 4.0)
    spike = MeshObject(0.123, 0.321, surface=box(1.0, 1.0, 1.0))
    assert first_contact_height(block.top, spike, 4.0, 2.0) == 3.0


def test_several_bumps_as_high_are_all_tried() -> None:
    def top(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        return 5.0 - 0.5 * (x - 7.003) ** 2 * (x + 7.003) ** 2 / 50.0 - 1e-3 * z**2 + 1e-7 * x

    assert first_contact_height(top, Plane(), 10.0, 2.0) == pytest.approx(5.0 + 7.003e-7, abs=1e-10)


@pytest.mark.parametrize(
    ("obj", "path", "text"),
    [
        (MeshObject(90.0, surface=ball(20.0)), PRESS, "never touches"),
        (Sphere(90.0, radius_mm=20.0), PRESS, "never touches"),
        (MeshObject(surface=channel(110.0, 45.0)), PRESS, "touches the base first"),
        (MeshObject(55.0, surface=box(10.0, 5.0, 30.0)), PRESS, "over no area: an edge or a wall touches first"),
        (MeshObject(0.0, 20.0, surface=box(10.0, 10.0, 10.0)), PRESS, "never touches"),
    ],
    ids=["beside", "sphere beside", "hangs to the base", "only the rim", "beside along z"],
)  # fmt: skip
def test_approaches_that_are_refused(obj: RigidObject, path: Sequence[Sequence[float]], text: str) -> None:
    with pytest.raises(Finger3dError, match=text) as refused:
        near(obj, path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("obj", "path", "text"),
    [
        (MeshObject(69.95, surface=ball(20.0)), PRESS, "a wall touches first"),
        (MeshObject(surface=channel(100.0, 20.0)), PRESS, "a wall touches first"),
        (MeshObject(surface=channel(110.0, 20.0)), [[5, 0, 0], [5, 8, 0]], "runs into the finger's side at x = -50"),
    ],
    ids=["flank at the rim", "tight channel", "slides into the side"],
)
def test_only_a_rigid_object_touches_the_walls(obj: RigidObject, path: Sequence[Sequence[float]], text: str) -> None:
    assert near(obj, path) > 0.0
    with pytest.raises(Finger3dError, match=text):
        near(obj, path, walls_touch=False)


@pytest.mark.parametrize(
    "obj",
    [Plane(tilt=1.2), Plane(tilt=-0.6), Sphere(65.0, radius_mm=20.0), MeshObject(surface=channel(110.0, 20.0)),
     MeshObject(surface=channel(98.0, 20.0)), Wave(60.0, wavelength_mm=50.0, amplitude_mm=2.0)],
)  # fmt: skip
def test_approaches_that_are_not(obj: RigidObject) -> None:
    assert math.isfinite(near(obj))
    assert near(obj, [[5.0, 0.0, 0.0], [5.0, 1.0, 0.5]]) == near(obj)


def test_the_zone_finds_a_tip_between_the_points_of_its_grid() -> None:
    tip = Sphere(0.1317, 0.077, radius_mm=1e-3)
    x0, x1, z0, z1 = initial_contact(ContactPath(FIG9.top, tip, 50.0, 10.0, (ObjectPose(1e-4),))).contact_box
    assert x0 <= 0.1317 <= x1 < x0 + 2e-3
    assert z0 <= 0.077 <= z1 < z0 + 2e-3


def test_a_mesh_object_stands_on_its_lowest_point() -> None:
    surface = ball(5.0)
    moved = MeshObject(3.0, -2.0, surface=replace(surface, points=surface.points + [7.0, 8.0, 9.0]))
    placed = PlacedObject.of(moved, 0.0)
    assert placed.height(np.array([3.0]), np.array([-2.0]))[0] == pytest.approx(0.0, abs=1e-12)
    assert PlacedObject.of(moved, 0.0, ObjectPose(0.0, 1.0, 0.5)).lowest == pytest.approx((4.0, -1.5))
    distance, normal = placed.distance(np.array([[3.0, -1.0, -2.0], [3.0, 1.0, -2.0]]))
    np.testing.assert_allclose(distance, [1.0, -1.0], atol=2e-2)
    np.testing.assert_allclose(normal, [[0, -1, 0]] * 2, atol=0.1)
    flat = MeshObject(surface=box(4.0, 1.0, 2.0, (1.0, 2.0, 3.0)))  # of many lowest points the middle
    height = flat.profile(np.array([1.99, 2.01]), np.zeros(2))
    assert height[0] == 0.0
    assert np.isnan(height[1])


def mirrors(obj: RigidObject) -> tuple[str, ...]:
    return PlacedObject.of(obj, 0.0).mirrors()


def test_mirrors_of_an_object_in_its_pose() -> None:
    assert mirrors(MeshObject(surface=ball(5.0))) == ("x", "z")
    assert mirrors(MeshObject(1.0, surface=ball(5.0))) == ("z",)
    skew = ball(5.0)
    sheared = replace(skew, points=skew.points + 0.1 * skew.points[:, [1, 0, 2]] * [1, 0, 0])
    assert mirrors(MeshObject(surface=sheared)) == ("z",)
    assert mirrors(Plane()) == ("x", "z")
    assert mirrors(Plane(tilt=0.1)) == ("z",)
    assert mirrors(Cylinder(2.0, radius_mm=5.0)) == ("z",)
    assert mirrors(Cylinder(radius_mm=5.0, turn_y=math.pi / 2.0)) == ("x", "z")
    assert mirrors(Cylinder(radius_mm=5.0, turn_y=0.3)) == ()
    assert mirrors(Sphere(radius_mm=5.0, turn_x=0.3, turn_y=1.0)) == ("x", "z")
    assert mirrors(Wave(2.5, wavelength_mm=5.0, amplitude_mm=0.3)) == ("x", "z")  # half a wavelength
    assert mirrors(Wedge(angle=0.4, turn_z=0.1)) == ("z",)


def pad(**changes: object) -> Model:
    body = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=4.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(0.8, 1.2, "swept"), (Leg(0.3, steps=2),), friction=Coulomb(0.25)
    )  # fmt: skip
    return replace(model, **changes)


def pressed(model: Model) -> tuple[dict[str, float], np.ndarray]:
    problem = build(model)
    last = list(march(problem))[-1]
    assert last.outcome.ok
    return measure(problem.points, last), problem.points.points[last.state.status != OPEN]


def test_a_triangulated_ball_presses_like_the_exact_one() -> None:
    exact, _ = pressed(pad(object=Sphere(radius_mm=4.0)))
    meshed, _ = pressed(pad(object=MeshObject(surface=ball(4.0, 60, 120))))
    # facets of 3 degrees lie up to 1.4 um inside, 0.5 % of the depth
    assert meshed["normal_force_N"] == pytest.approx(exact["normal_force_N"], rel=0.01)
    assert abs(meshed["tangential_force_x_N"]) < 1e-10  # symmetric, so the quarter is solved


def test_what_lies_beside_a_narrow_object_is_not_touched() -> None:
    narrow = MeshObject(surface=box(3.0, 1.0, 6.0))
    got, touching = pressed(pad(object=narrow))
    assert np.abs(touching[:, 0]).max() <= 1.5 + 0.4  # a point counts from half of its hat on
    wide, _ = pressed(pad(object=MeshObject(surface=box(9.0, 1.0, 6.0))))
    plane, _ = pressed(pad(object=Plane()))
    assert wide["normal_force_N"] == pytest.approx(plane["normal_force_N"], rel=1e-9)
    assert 0.3 < got["normal_force_N"] / plane["normal_force_N"] < 0.7


def test_turning_a_mesh_object_and_its_slide_turns_the_result() -> None:
    # A quarter turn about y of a square pad: x becomes z. The mesh is not its own image, so to its accuracy only.
    square = designs()["block"](half_length_mm=3.0, height_mm=3.0, width_mm=6.0)
    surface = replace(ball(4.0), points=ball(4.0).points * [1.8, 1.0, 1.0])
    turned = replace(surface, points=surface.points[:, [2, 1, 0]] * [1.0, 1.0, -1.0])
    options = MeshOptions(0.4, 1.5, "swept")
    legs = (Leg(0.2, steps=1), Leg(0.2, slide_x_mm=0.05, steps=1))
    across = (Leg(0.2, steps=1), Leg(0.2, slide_z_mm=-0.05, steps=1))
    a, _ = pressed(pad(design=square, mesh=options, object=MeshObject(0.5, 0.2, surface=surface), legs=legs))
    b, _ = pressed(pad(design=square, mesh=options, object=MeshObject(0.2, -0.5, surface=turned), legs=across))
    assert b["normal_force_N"] == pytest.approx(a["normal_force_N"], rel=0.03)
    assert b["tangential_force_z_N"] == pytest.approx(-a["tangential_force_x_N"], rel=0.05)
