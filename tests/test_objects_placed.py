"""Poses of an object; distances in a pose against dense samples of surfaces, and motions against rotations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

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
from tests.bodies import ball, box, random_points


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
