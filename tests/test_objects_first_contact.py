"""First touch of rigid objects: closed forms of two parabolas and of spheres, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.objects import Cylinder, Plane, Sphere, Wedge, initial_contact
from finger3d.objects.first_contact import ContactPath, first_contact_height


def dome(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Height of a sphere of radius 50 mm with its top at 10 mm."""
    return 10.0 - 50.0 + np.sqrt(50.0**2 - x**2 - z**2)


def path(obj: object, depth: float = 1.0, slide: float = 0.0) -> ContactPath:
    return ContactPath(dome, obj, 10.0, 8.0, np.array([[depth, 0.0, 0.0], [depth, slide, 0.0]]))


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
