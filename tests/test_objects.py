"""Rigid objects: exact heights, where they touch first, approaches that are refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.objects import (
    Cylinder,
    MeshObject,
    Plane,
    RigidObject,
    Sphere,
    Wave,
    Wedge,
)
from tests.bodies import box
from tests.object_cases import pad, pressed


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


def test_what_lies_beside_a_narrow_object_is_not_touched() -> None:
    narrow = MeshObject(surface=box(3.0, 1.0, 6.0))
    got, touching = pressed(pad(object=narrow))
    assert np.abs(touching[:, 0]).max() <= 1.5 + 0.4  # a point counts from half of its hat on
    wide, _ = pressed(pad(object=MeshObject(surface=box(9.0, 1.0, 6.0))))
    plane, _ = pressed(pad(object=Plane()))
    assert wide["normal_force_N"] == pytest.approx(plane["normal_force_N"], rel=1e-9)
    assert 0.3 < got["normal_force_N"] / plane["normal_force_N"] < 0.7
