"""Objects as dataclasses: their shortest lengths, and angles in radians behind keys in degrees; the wave."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError

import numpy as np
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


def test_profile_crests_and_detail() -> None:
    wave = Wave(wavelength_mm=4.0, amplitude_mm=0.5, axis="x")
    assert wave.section_profile(np.array([0.0, 1.0, 2.0, 4.0])) == pytest.approx([0.0, 0.5, 1.0, 0.0], abs=1e-15)
    assert wave.detail.length_mm == 4.0
    assert not wave.is_convex
    assert Wave(wavelength_mm=4.0, amplitude_mm=0.0).is_convex


def test_the_clearance_never_exceeds_the_distance() -> None:
    wave, rng = Wave(wavelength_mm=3.0, amplitude_mm=1.0), np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-5.0, 5.0, 100), rng.uniform(-8.0, -0.1, 100), np.zeros(100)])
    assert (wave.clearance(points) <= wave.distance(points)[0] + 1e-12).all()
