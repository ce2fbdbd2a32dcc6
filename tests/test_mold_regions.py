"""Plane regions and booleans of triangles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.mold import regions
from tests.bodies import box


@pytest.mark.parametrize(("axis", "wanted"), [("x", (4.0, 6.0)), ("y", (6.0, 2.0)), ("z", (2.0, 4.0))])
def test_a_section_has_its_axes_in_cyclic_order(axis, wanted) -> None:
    x0, y0, x1, y1 = regions.section(box(2.0, 4.0, 6.0), axis, 0.1).bounds()
    assert (x1 - x0, y1 - y0) == pytest.approx(wanted)


def test_a_footprint_is_x_and_z() -> None:
    x0, z0, x1, z1 = regions.footprint(box(2.0, 4.0, 6.0), 1e-3).bounds()
    assert (x1 - x0, z1 - z0) == pytest.approx((2.0, 6.0))


def test_a_widened_rectangle_has_round_corners() -> None:
    """Steiner's formula: area + perimeter d + pi d^2; chords lie up to 0.08 mm inside the 12.6 mm of arcs, 1 %."""
    found = regions.widened(regions.rectangle((0.0, 0.0), (10.0, 4.0)), 2.0).area()
    assert found == pytest.approx(40.0 + 28.0 * 2.0 + math.pi * 4.0, rel=1e-2)
    assert regions.disc((1.0, 1.0), 2.0).area() == pytest.approx(math.pi, rel=2e-3)


def test_points_inside_and_nearest_points() -> None:
    ring = regions.disc((0.0, 0.0), 4.0) - regions.disc((0.0, 0.0), 2.0)
    points = np.array([[0.0, 0.0], [1.5, 0.0], [3.0, 0.0]])
    assert regions.inside(ring, points).tolist() == [False, True, False]
    assert regions.nearest(ring, (3.0, 0.0)) == pytest.approx((2.0, 0.0), abs=1e-2)
    assert regions.nearest(ring, (1.5, 0.0)) == (1.5, 0.0)


def test_prisms_stand_where_they_should() -> None:
    """A square with a hole and another square, along y and along z, up and down."""
    square = regions.rectangle((0.0, 1.0), (4.0, 5.0)) - regions.rectangle((1.0, 2.0), (2.0, 3.0))
    region = square + regions.rectangle((6.0, 1.0), (7.0, 2.0))
    for axis, i in (("y", 1), ("z", 2)):
        for length in (2.0, -2.0):
            found = regions.prisms(region, axis, 3.0, length)
            assert sum(s.volume for s in found) == pytest.approx(2.0 * 16.0)
            low = min([*s.bounding_box().min][i] for s in found)
            assert low == pytest.approx(3.0 + min(length, 0.0), abs=1e-6)
            other = 3 - i
            assert max([*s.bounding_box().max][other] for s in found) == pytest.approx(5.0, abs=1e-6)


def test_booleans_of_triangles() -> None:
    a, b = box(2.0, 2.0, 2.0), box(2.0, 2.0, 2.0, (1.0, 1.0, 1.0))
    assert regions.common(a, b) == pytest.approx(1.0)
    assert regions.difference(a, [b]).volume == pytest.approx(7.0)
    with pytest.raises(Finger3dError, match="closed"):
        regions.manifold(Triangles(a.points, a.faces[1:]))
