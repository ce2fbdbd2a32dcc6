"""First touch of rigid objects: closed forms of two parabolas and of spheres, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.objects import Cylinder, ObjectPose, Plane, Sphere, Wave, Wedge, initial_contact
from finger3d.objects.first_contact import ContactPath, first_contact_height


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
    assert first_contact_height(dome, wedge, 10.0, 8.0) == pytest.approx(expected, abs=1e-6)


def test_the_contact_box_follows_a_slide() -> None:
    still, slid = (initial_contact(path(Sphere(radius_mm=5.0), slide=s)).contact_box for s in (0.0, 3.0))
    assert slid[0] == pytest.approx(still[0], abs=0.2)
    assert slid[1] > still[1] + 2.0


def test_an_object_that_touches_the_base_first_is_refused() -> None:
    with pytest.raises(Finger3dError, match="touches the base first"):
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
    with pytest.raises(Finger3dError, match="does not touch it"):
        initial_contact(ContactPath(dome, beside, 10.0, 8.0, poses))
