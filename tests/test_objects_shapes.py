"""Objects as dataclasses: their shortest lengths, and angles in radians behind keys in degrees."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError

import pytest

from finger3d.objects import OBJECTS, Cylinder, Plane, RigidObject, Sphere, Wave, Wedge
from finger3d.scene.tables import record_of, table_of


@pytest.mark.parametrize(
    ("obj", "length"),
    [
        (Plane(), None),
        (Sphere(radius_mm=3.0), 3.0),
        (Cylinder(radius_mm=4.0), 4.0),
        (Wedge(angle=0.5), None),
        (Wedge(angle=0.5, tip_radius_mm=0.2), 0.2),
        (Wave(wavelength_mm=5.0, amplitude_mm=0.1), 5.0),
    ],
)
def test_the_detail_is_the_shortest_length_of_the_surface(obj: RigidObject, length: float | None) -> None:
    assert (obj.detail.length_mm if obj.detail else None) == length
    assert obj.is_flat == isinstance(obj, Plane)


def test_angles_are_degrees_in_a_table_and_radians_in_the_object() -> None:
    table = table_of(Wedge).model_validate({"angle_deg": 30.0})
    assert record_of(Wedge, table) == Wedge(angle=math.radians(30.0))


def test_every_object_is_frozen() -> None:
    for record in OBJECTS.values():
        assert issubclass(record, RigidObject)
    with pytest.raises(FrozenInstanceError):
        Sphere(radius_mm=1.0).radius_mm = 2.0
