"""Distances of points that are followed."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.objects import DistanceTracker, MeshObject, Move, ObjectPose, PlacedObject
from tests.bodies import ball, random_points


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
