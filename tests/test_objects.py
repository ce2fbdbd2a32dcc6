"""Rigid objects: distances, places, first contact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import KDTree

from finger3d.contact.friction import OPEN
from finger3d.errors import Finger3dError
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.objects import (
    Cylinder,
    DistanceTracker,
    MeshObject,
    Move,
    ObjectPose,
    PlacedObject,
    Plane,
    RigidObject,
    Sphere,
    Wave,
    Wedge,
)
from finger3d.objects.first_contact import ContactPath, first_touch, initial_contact
from finger3d.objects.rigid import Prism, rotation
from finger3d.scene import scene_of
from tests.bodies import ball, box, channel, random_points
from tests.designs import FIG9, SMALL
from tests.models import block, ended


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


def pressed(**changes: Any) -> tuple[dict[str, float], np.ndarray]:
    """Quantities at the end of a press of a block in two increments, and the points (n, 3) mm in contact."""
    problem, last = ended(block(**{"legs": (Leg(0.3, steps=2),)} | changes))
    return measure(problem.points, last), problem.points.points[last.state.status != OPEN]


def test_what_lies_beside_a_narrow_object_is_not_touched() -> None:
    narrow = MeshObject(surface=box(3.0, 1.0, 6.0))
    got, touching = pressed(object=narrow)
    assert np.abs(touching[:, 0]).max() <= 1.5 + 0.4  # a point counts from half of its hat on
    wide, _ = pressed(object=MeshObject(surface=box(9.0, 1.0, 6.0)))
    plane, _ = pressed(object=Plane())
    assert wide["normal_force_N"] == pytest.approx(plane["normal_force_N"], rel=1e-9)
    assert 0.3 < got["normal_force_N"] / plane["normal_force_N"] < 0.7


@pytest.mark.parametrize(
    "obj",
    [
        Cylinder(0.3, radius_mm=4.0),
        Cylinder(0.0, 0.2, radius_mm=4.0, axis="x"),
        Sphere(0.3, -0.2, radius_mm=4.0),
    ],
)
def test_its_contact_face_is_the_surface_of_the_object(obj: RigidObject) -> None:
    held = obj.held_body(SMALL, True)
    assert held is not None
    half = np.array([held.design.half_length_mm, 0.5 * held.design.width_mm])
    x, z = (0.9 * np.random.default_rng(0).uniform(-1.0, 1.0, (40, 2)) * half).T
    top = held.design.top(x, z)
    there = np.isfinite(top)
    at = held.to_scene(np.column_stack([x, top, z])[there])
    # the design stands with its base at y = 0: the object's lowest point is its height below
    at[:, 1] += held.design.height_mm
    distance, _ = PlacedObject.of(obj, 0.0).distance(at)
    assert np.abs(distance).max() < 1e-12


def test_turns_are_about_fixed_axes_x_first() -> None:
    quarter = 0.5 * np.pi
    # y goes to z about x, and z to x about y
    assert rotation(quarter, quarter, 0.0) @ [0.0, 1.0, 0.0] == pytest.approx([1.0, 0.0, 0.0], abs=1e-15)
    assert rotation(0.0, 0.0, quarter) @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    turned = rotation(0.3, -0.7, 1.1)
    assert turned @ turned.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.array_equal(rotation(0.0, 0.0, 0.0), np.eye(3))


@pytest.mark.parametrize("axis", ["x", "z"])
@pytest.mark.parametrize("kind", [Cylinder, Wave, Wedge])
def test_a_prism_is_the_same_all_along_its_axis(kind: type[Prism], axis: str) -> None:
    sizes = {Cylinder: {"radius_mm": 3.0}, Wave: {"wavelength_mm": 2.0, "amplitude_mm": 0.3}, Wedge: {"angle": 0.3}}
    obj = kind(axis=axis, **sizes[kind])
    points = np.random.default_rng(0).uniform(-2.0, 2.0, (20, 3))
    value, gradient = obj.distance(points)
    moved, same = obj.distance(points + 5.0 * obj.direction)
    assert moved == pytest.approx(value, rel=1e-12, abs=1e-12)
    assert same == pytest.approx(gradient, rel=1e-9, abs=1e-9)
    assert gradient @ obj.direction == pytest.approx(np.zeros(20))
    drawn = obj.drawing(1.0)
    assert np.abs(obj.distance(drawn.points)[0]).max() < 1e-12
    assert obj.is_level(np.eye(3))
    assert not obj.is_level(rotation(0.1, 0.0, 0.0) if axis == "z" else rotation(0.0, 0.0, 0.1))


@pytest.mark.parametrize("amplitude", [0.05, 2.0])
def test_the_nearest_point_is_found_on_flat_and_on_steep_waves(amplitude: float) -> None:
    wave = Wave(wavelength_mm=3.0, amplitude_mm=amplitude)
    rng = np.random.default_rng(0)
    r, y = rng.uniform(-6.0, 6.0, 40), rng.uniform(-3.0, 5.0, 40)
    distance, slope_r, slope_y = wave.section_distance(r, y)
    curve = np.linspace(-12.0, 12.0, 200_001)
    height = wave.section_profile(curve)
    dense = np.array([np.hypot(curve - a, height - b).min() for a, b in zip(r, y, strict=True)])
    # between points of the curve 1.2e-4 mm apart the distance is off by the square of half of that over itself
    assert np.abs(np.abs(distance) - dense).max() < 1e-4
    assert ((distance < 0.0) == (y > wave.section_profile(r))).all()
    assert np.hypot(slope_r, slope_y) == pytest.approx(np.ones(40))


def test_the_clearance_never_exceeds_the_distance() -> None:
    wave, rng = Wave(wavelength_mm=3.0, amplitude_mm=1.0), np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-5.0, 5.0, 100), rng.uniform(-8.0, -0.1, 100), np.zeros(100)])
    assert (wave.clearance(points) <= wave.distance(points)[0] + 1e-12).all()


GEAR = Path(__file__).parents[1] / "geometries" / "gear.stl"


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


def test_a_triangulated_ball_presses_like_the_exact_one() -> None:
    exact, _ = pressed(object=Sphere(radius_mm=4.0))
    meshed, _ = pressed(object=MeshObject(surface=ball(4.0, 60, 120)))
    # facets of 3 degrees lie up to 1.4 um inside, 0.5 % of the depth
    assert meshed["normal_force_N"] == pytest.approx(exact["normal_force_N"], rel=0.01)
    assert abs(meshed["tangential_force_x_N"]) < 1e-10  # symmetric, so the quarter is solved


def test_points_in_contact_beside_a_gear_lie_on_its_teeth() -> None:
    # the gap of a point is a mean over samples of the finger's face, some of which are far from any tooth
    scene = scene_of(
        {
            "finger": {"geometry": "block", "half_length_mm": 8.0, "height_mm": 6.0, "width_mm": 6.0},
            "material": {"E_MPa": 1.0, "nu": 0.4}, "friction": {"mu": 2.0}, "press": {"depth_mm": 0.8, "steps": 4},
            "object": {"shape": "mesh", "path": str(GEAR), "x_mm": -1.952}, "model": {"domain": "plane-strain"},
            "mesh": {"size_mm": 0.8, "base_size_mm": 1.6, "mesher": "swept"},
        }
    )  # fmt: skip
    for step in march(build(scene.model())):
        assert step.outcome.ok
        closed = step.state.status != OPEN
        assert closed.any()
        # the tolerance of the iteration, over the depth
        assert np.abs(step.state.gap[closed]).max() <= 1e-8 * step.target.depth_mm


def test_material_points_of_a_twisted_object_go_round_its_reference_point() -> None:
    angle, at = 0.01, random_points(20)
    before = PlacedObject.of(Sphere(1.0, radius_mm=3.0), 5.0, ObjectPose(0.2))
    after = PlacedObject.of(Sphere(1.0, radius_mm=3.0), 5.0, ObjectPose(0.2, turn_y=angle))
    arm = at - [1.0, 4.8, 0.0]
    moved = after.moved_from(before, at)
    assert moved == pytest.approx(np.cross([0.0, angle, 0.0], arm), abs=0.51 * angle**2 * 3.0)
    assert moved[:, 1] == pytest.approx(0.0, abs=1e-12)


SHAPES = [
    Plane(),
    Plane(tilt=0.4),
    Cylinder(radius_mm=3.0),
    Cylinder(radius_mm=3.0, axis="x"),
    Sphere(radius_mm=3.0),
    Wedge(angle=0.6),
    Wedge(angle=0.6, tip_radius_mm=1.0, axis="x"),
    Wave(wavelength_mm=3.0, amplitude_mm=0.4),
]
TURNED = ObjectPose(0.3, 0.4, -0.2, turn_x=0.2, turn_y=-0.5, turn_z=0.3)


@pytest.mark.parametrize("obj", SHAPES, ids=repr)
def test_the_distance_is_that_of_the_nearest_point_of_the_surface(obj: RigidObject) -> None:
    x, z = (v.ravel() for v in np.meshgrid(np.linspace(-3.0, 3.0, 601), np.linspace(-3.0, 3.0, 601)))
    y = obj.profile(x, z)
    known = np.isfinite(y)
    surface = np.stack([x, y, z], axis=1)[known]
    at = random_points(300)
    value, gradient = obj.distance(at)
    nearest = KDTree(surface).query(at)[0]
    # a grid of 10 um misses the nearest point by up to 7 um: the distance is longer by 7^2 / 2d um, 7 um at the surface
    assert np.abs(np.abs(value) - nearest).max() < 1e-2
    assert ((value < 0.0) == (at[:, 1] > obj.profile(at[:, 0], at[:, 2])))[np.abs(value) > 1e-2].all()
    assert np.linalg.norm(gradient, axis=1) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("obj", SHAPES, ids=repr)
def test_the_gradient_is_the_derivative_and_no_slope_exceeds_one(obj: RigidObject) -> None:
    placed, at, step = PlacedObject.of(obj, 1.0, TURNED), random_points(400, 1), 1e-6
    value, gradient = placed.distance(at)
    ahead, behind = (
        np.stack([placed.distance(at + sign * step * e)[0] for e in np.eye(3)], axis=1) for sign in (1.0, -1.0)
    )
    smooth = np.abs(ahead + behind - 2.0 * value[:, None]).max(axis=1) < 1e-9  # not on the medial axis
    assert smooth.mean() > 0.95
    assert np.abs((ahead - behind) / (2.0 * step) - gradient)[smooth].max() < 1e-5
    others = random_points(400, 2)
    assert (np.abs(value - placed.distance(others)[0]) <= np.linalg.norm(at - others, axis=1) + 1e-12).all()


@pytest.mark.parametrize("obj", SHAPES, ids=repr)
def test_a_turned_object_is_a_turned_scene(obj: RigidObject) -> None:
    at, placed = random_points(100), PlacedObject.of(obj, 1.0, TURNED)
    reference = np.array([0.4, 0.7, -0.2])
    own = (at - reference) @ TURNED.turn
    assert placed.distance(at)[0] == pytest.approx(obj.distance(own)[0], abs=1e-12)
    assert placed.distance(at)[1] == pytest.approx(obj.distance(own)[1] @ TURNED.turn.T, abs=1e-9)


@pytest.mark.parametrize("obj", [*SHAPES[1:4], SHAPES[7]], ids=repr)
def test_the_height_of_a_turned_object_is_where_a_line_from_below_meets_it_first(obj: RigidObject) -> None:
    placed = PlacedObject.of(obj, 1.0, ObjectPose(0.0, turn_x=0.2, turn_y=0.5, turn_z=0.1))
    x, _, z = random_points(50).T
    y = placed.height(x, z)
    met = np.isfinite(y)
    assert met.any()
    assert np.abs(placed.distance(np.stack([x, y, z], axis=1)[met])[0]).max() < 1e-9
    for below in (1e-3, 0.1, 1.0, 10.0):
        assert placed.distance(np.stack([x, y - below, z], axis=1)[met])[0].min() > 0.0


@pytest.mark.parametrize(
    "obj", [Sphere(radius_mm=2.0), Cylinder(radius_mm=2.0), MeshObject(surface=box(2.0, 1.0, 3.0))]
)
def test_the_lowest_point_of_a_turned_object_is_its_reference_point(obj: RigidObject) -> None:
    kind = type(obj)
    fields = {name: getattr(obj, name) for name in ("radius_mm", "surface") if hasattr(obj, name)}
    turns = {"turn_y": 0.7} if kind is Cylinder else {"turn_x": 0.3, "turn_z": 0.5}
    placed = PlacedObject.of(kind(1.0, -2.0, **turns, **fields), 4.0)
    assert placed.lowest == pytest.approx((1.0, -2.0), abs=1e-9)
    x, z = (v.ravel() for v in np.meshgrid(np.linspace(0.5, 1.5, 101), np.linspace(-2.5, -1.5, 101)))
    assert np.nanmin(placed.height(x, z)) == pytest.approx(4.0, abs=1e-4)


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


@pytest.mark.parametrize("within", [0.05, np.inf])
def test_tracked_distances_are_exact_where_they_are_small(within: float) -> None:
    obj = MeshObject(surface=ball(2.0))
    tracker, at = DistanceTracker(), random_points(200) - [0.0, 1.0, 0.0]
    last = ObjectPose(0.8, 0.5, 0.2, turn_y=0.3)
    for share in np.linspace(0.0, 1.0, 12):
        placed = PlacedObject.of(obj, 0.0, Move(ObjectPose(0.0), last).at(float(share)))
        value, gradient = tracker.distance(placed, at, within)
        exact, normal = placed.distance(at)
        near = exact < within
        assert value[near] == pytest.approx(exact[near], abs=1e-12)
        assert gradient[near] == pytest.approx(normal[near], abs=1e-12)
        assert (value[~near] > min(within, exact[~near].min(initial=np.inf)) - 1e-12).all()


TOP = 36.6 + 100.0 - math.sqrt(100.0**2 - 50.0**2)
PRESS = ((10.0, 0.0, 0.0),)


def dome(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Height of a sphere of radius 50 mm with its top at 10 mm."""
    return 10.0 - 50.0 + np.sqrt(50.0**2 - x**2 - z**2)


def path(obj: object, depth: float = 1.0, slide: float = 0.0) -> ContactPath:
    return ContactPath(dome, obj, 10.0, 8.0, (ObjectPose(depth), ObjectPose(depth, slide)))


def test_a_plane_touches_at_the_top() -> None:
    contact = initial_contact(path(Plane()))
    assert contact.first_contact_mm == pytest.approx(10.0, abs=1e-9)
    assert contact.place == pytest.approx((0.0, 0.0), abs=1e-3)
    # chord of a sphere at depth 1: sqrt(2 R d - d^2)
    half = np.sqrt(2.0 * 50.0 - 1.0)
    assert contact.contact_box == pytest.approx((-half, half, -8.0, 8.0), rel=0.05)


@pytest.mark.parametrize("x", [0.0, 2.0, -3.5])
def test_a_ball_off_the_axis_touches_on_the_line_between_the_centres(x: float) -> None:
    found = initial_contact(path(Sphere(radius_mm=5.0, x_mm=x)))
    # the centres are 55 mm apart, one at (0, -40), the other at (x, lowest + 5)
    lowest = -40.0 + np.sqrt(55.0**2 - x**2) - 5.0
    assert found.first_contact_mm == pytest.approx(lowest, abs=1e-6)
    assert found.place == pytest.approx((50.0 / 55.0 * x, 0.0), abs=1e-3)


def test_an_edge_between_the_points_of_the_grid_is_found() -> None:
    wedge = Wedge(angle=1.0, x_mm=0.123)
    expected = float(dome(np.array(0.123), np.array(0.0)))
    assert first_touch(ContactPath(dome, wedge, 10.0, 8.0)).height_mm == pytest.approx(expected, abs=1e-6)


def test_an_object_that_touches_the_base_first_is_refused() -> None:
    with pytest.raises(Finger3dError, match="base"):
        initial_contact(path(Cylinder(radius_mm=40.0, x_mm=45.0, axis="z"), depth=9.0))


def test_a_body_turned_to_extend_downwards_would_start_in_the_finger() -> None:
    for obj in (Plane(turn_z=np.pi), Wave(wavelength_mm=4.0, amplitude_mm=0.5, turn_x=np.pi)):
        with pytest.raises(Finger3dError, match="starts? inside"):
            initial_contact(path(obj))


def test_a_turned_cylinder_touches_where_its_own_lowest_line_meets_the_dome() -> None:
    along_x = initial_contact(path(Cylinder(radius_mm=5.0, axis="x")))
    turned = initial_contact(path(Cylinder(radius_mm=5.0, axis="z", turn_y=np.pi / 2.0)))
    assert turned.first_contact_mm == pytest.approx(along_x.first_contact_mm, abs=1e-9)
    assert turned.contact_box == pytest.approx(along_x.contact_box, abs=1e-9)


def test_a_turn_that_takes_the_object_off_the_finger_is_refused() -> None:
    beside = Sphere(15.0, radius_mm=30.0)  # its lowest point, about which it turns, is beside the dome
    poses = (ObjectPose(1.0), ObjectPose(1.0, turn_z=-np.pi / 2.0))
    with pytest.raises(Finger3dError, match="touch"):
        initial_contact(ContactPath(dome, beside, 10.0, 8.0, poses))


def near(obj: RigidObject, path: Sequence[Sequence[float]] = PRESS, walls_touch: bool = True) -> float:
    poses = tuple(ObjectPose(*target) for target in path)
    way = ContactPath(FIG9.top, obj, 50.0, 10.0, poses, walls_touch=walls_touch)
    return initial_contact(way).first_contact_mm


@pytest.mark.parametrize(
    "obj",
    [Plane(), Sphere(radius_mm=20.0), Sphere(30.0, 4.0, radius_mm=20.0), Cylinder(radius_mm=5.0, axis="x"),
     Wedge(12.3, angle=0.4), Wave(1.7, wavelength_mm=4.0, amplitude_mm=0.5), Sphere(-17.77, 3.33, radius_mm=0.01)],
)  # fmt: skip
def test_first_touch_is_the_largest_overlap_of_the_real_surfaces(obj: RigidObject) -> None:
    touch = first_touch(ContactPath(FIG9.top, obj, 50.0, 10.0)).height_mm
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
    assert first_touch(ContactPath(block.top, spike, 4.0, 2.0)).height_mm == 3.0


def test_several_bumps_as_high_are_all_tried() -> None:
    def top(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        return 5.0 - 0.5 * (x - 7.003) ** 2 * (x + 7.003) ** 2 / 50.0 - 1e-3 * z**2 + 1e-7 * x

    assert first_touch(ContactPath(top, Plane(), 10.0, 2.0)).height_mm == pytest.approx(5.0 + 7.003e-7, abs=1e-10)


@pytest.mark.parametrize(
    ("obj", "path", "text"),
    [
        (MeshObject(69.95, surface=ball(20.0)), PRESS, "wall"),
        (MeshObject(surface=channel(100.0, 20.0)), PRESS, "wall"),
        (MeshObject(surface=channel(110.0, 20.0)), [[5, 0, 0], [5, 8, 0]], "x = -50"),
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
