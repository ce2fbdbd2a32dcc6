"""Poses of an object."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.objects import ObjectPose, PlacedObject, Sphere
from tests.bodies import random_points


def test_material_points_of_a_twisted_object_go_round_its_reference_point() -> None:
    angle, at = 0.01, random_points(20)
    before = PlacedObject.of(Sphere(1.0, radius_mm=3.0), 5.0, ObjectPose(0.2))
    after = PlacedObject.of(Sphere(1.0, radius_mm=3.0), 5.0, ObjectPose(0.2, turn_y=angle))
    arm = at - [1.0, 4.8, 0.0]
    moved = after.moved_from(before, at)
    assert moved == pytest.approx(np.cross([0.0, angle, 0.0], arm), abs=0.51 * angle**2 * 3.0)
    assert moved[:, 1] == pytest.approx(0.0, abs=1e-12)
