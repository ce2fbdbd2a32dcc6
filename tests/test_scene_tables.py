"""Tables of a scene."""

from __future__ import annotations

import math

import pytest

from finger3d.objects import Cylinder, Plane, Sphere, Wave, Wedge
from finger3d.scene import parse
from tests.scene_tables import SMALL


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ({"shape": "plane", "tilt_deg": 3.0, "x_mm": 1.0}, Plane(1.0, 0.0, tilt=math.radians(3.0))),
        ({"shape": "cylinder", "radius_mm": 5.0, "axis": "x"}, Cylinder(0.0, 0.0, radius_mm=5.0, axis="x")),
        ({"shape": "sphere", "radius_mm": 5.0, "z_mm": 2.0}, Sphere(0.0, 2.0, radius_mm=5.0)),
        (
            {"shape": "wedge", "angle_deg": 30.0, "tip_radius_mm": 1.0},
            Wedge(0.0, 0.0, angle=math.radians(30.0), tip_radius_mm=1.0),
        ),
        (
            {"shape": "wave", "wavelength_mm": 5.0, "amplitude_mm": 0.2},
            Wave(0.0, 0.0, wavelength_mm=5.0, amplitude_mm=0.2),
        ),
    ],
)
def test_objects_arrive_with_angles_in_radians(table, expected) -> None:
    assert parse({**SMALL, "object": table}).model().object == expected


def test_whole_numbers_serve_as_numbers() -> None:
    assert parse({**SMALL, "friction": {"mu": 1}}) == parse({**SMALL, "friction": {"mu": 1.0}})
