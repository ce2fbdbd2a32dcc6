"""Plane regions and booleans of triangles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection

from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.mold import regions
from tests.bodies import box


def test_the_base_is_x_and_z() -> None:
    x0, z0, x1, z1 = regions.base_region(box(2.0, 4.0, 6.0, (1.0, 0.0, 0.0))).bounds()
    assert (x0, x1, z0, z1) == pytest.approx((0.0, 2.0, -3.0, 3.0))


def test_a_widened_rectangle_has_round_corners() -> None:
    """Steiner's formula: area + perimeter d + pi d^2; chords lie up to 0.08 mm inside the 12.6 mm of arcs, 1 %."""
    found = regions.widened(CrossSection.square((10.0, 4.0)), 2.0).area()
    assert found == pytest.approx(40.0 + 28.0 * 2.0 + math.pi * 4.0, rel=1e-2)
    assert regions.disc((1.0, 1.0), 2.0).area() == pytest.approx(math.pi, rel=2e-3)


def test_points_inside_and_nearest_points() -> None:
    ring = regions.disc((0.0, 0.0), 4.0) - regions.disc((0.0, 0.0), 2.0)
    points = np.array([[0.0, 0.0], [1.5, 0.0], [3.0, 0.0]])
    assert regions.inside(ring, points).tolist() == [False, True, False]
    assert regions.nearest(ring, (3.0, 0.0)) == pytest.approx((2.0, 0.0), abs=1e-2)
    assert regions.nearest(ring, (1.5, 0.0)) == (1.5, 0.0)


def test_booleans_of_triangles() -> None:
    a, b = box(2.0, 2.0, 2.0), box(2.0, 2.0, 2.0, (1.0, 1.0, 1.0))
    assert regions.common(a, b) == pytest.approx(1.0)
    assert regions.difference(a, [b]).volume == pytest.approx(7.0)
    with pytest.raises(Finger3dError, match="closed"):
        regions.manifold(Triangles(a.points, a.faces[1:]))
