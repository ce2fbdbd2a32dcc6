"""First touch of rigid objects: closed forms of two parabolas and of spheres, and refusals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.registry import designs
from finger3d.objects import (
    Cylinder,
    MeshObject,
    ObjectPose,
    PlacedObject,
    Plane,
    RigidObject,
    Sphere,
    Wave,
    Wedge,
)
from finger3d.objects.first_contact import ContactPath, first_touch, initial_contact
from tests.bodies import ball, box, channel
from tests.designs import FIG9

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


def test_the_contact_box_follows_a_slide() -> None:
    still, slid = (initial_contact(path(Sphere(radius_mm=5.0), slide=s)).contact_box for s in (0.0, 3.0))
    assert slid[0] == pytest.approx(still[0], abs=0.2)
    assert slid[1] > still[1] + 2.0


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
        (MeshObject(90.0, surface=ball(20.0)), PRESS, "never"),
        (Sphere(90.0, radius_mm=20.0), PRESS, "never"),
        (MeshObject(surface=channel(110.0, 45.0)), PRESS, "base"),
        (MeshObject(55.0, surface=box(10.0, 5.0, 30.0)), PRESS, "area"),
        (MeshObject(0.0, 20.0, surface=box(10.0, 10.0, 10.0)), PRESS, "never"),
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
