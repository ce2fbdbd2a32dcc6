"""Contact points on a regular grid."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mechanics.discretise.regular_points import regular_points
from tests.models import block, fig9


def test_points_have_the_distance_asked_for_and_lie_on_the_surface() -> None:
    points = regular_points(fig9(), (-10.0, 10.0, -4.0, 4.0), 2.0)
    x, z = np.unique(points.points[:, 0]), np.unique(points.points[:, 2])
    assert np.diff(x) == pytest.approx(np.full(len(x) - 1, 2.0))
    assert np.diff(z) == pytest.approx(np.full(len(z) - 1, 2.0))
    assert x.min() <= -10.0 <= 10.0 <= x.max()
    # the circle of radius 100 mm through the top at 50 mm
    height = 36.6 + np.sqrt(100.0**2 - points.points[:, 0] ** 2) - np.sqrt(100.0**2 - 50.0**2)
    assert points.points[:, 1] == pytest.approx(height, rel=1e-12)


@pytest.mark.parametrize("domain", ["solid", "plane-strain"])
def test_means_of_a_linear_function_are_its_values_at_inner_points(domain: str) -> None:
    points = regular_points(block(domain=domain), (-1.0, 1.0, -1.0, 1.0), 0.5)
    ends = np.abs(points.points - points.points.mean(axis=0)).max(axis=0)
    inner = (np.abs(points.points[:, ::2]) < ends[::2] - 1e-9).all(axis=1)
    assert inner.any()
    slope = np.array([0.3, 0.0, -0.7])[: points.points.shape[1]]
    assert (points.average @ (points.samples @ slope))[inner] == pytest.approx(
        (points.points @ slope)[inner], abs=1e-12
    )
    assert np.asarray(points.average.sum(axis=1)).ravel() == pytest.approx(np.ones(len(points.points)))


def test_the_box_ends_with_the_finger_and_a_place_lies_between_four_points() -> None:
    points = regular_points(block(), (-9.0, 9.0, -9.0, 9.0), 0.7, np.array([0.2, 0.1]))
    assert np.abs(points.points[:, 0]).max() == 4.0
    assert np.abs(points.points[:, 2]).max() == 2.0
    near = np.sort(np.hypot(points.points[:, 0] - 0.2, points.points[:, 2] - 0.1))[:4]
    assert near == pytest.approx(np.full(4, 0.35 * np.sqrt(2.0)))
