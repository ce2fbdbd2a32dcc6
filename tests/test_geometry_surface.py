"""Triangulated surfaces: heights, closest points, signed distances, their speed, and surfaces that are no body."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake
from tests.bodies import ball, box, channel


@pytest.fixture(scope="module")
def large() -> Triangles:
    """A ball of 100 000 triangles, radius 10."""
    return ball(10.0, 251, 200)


def test_the_bodies_themselves_are_sound() -> None:
    for surface, volume in ((box(2, 3, 4), 24.0), (channel(10, 4, 2, 5), 5 * (14 * 6 - 40)), (ball(3.0), None)):
        assert mistake(surface) == ""
        if volume:
            assert surface.volume == pytest.approx(volume, rel=1e-14)


def test_height_is_exact_on_the_triangles_and_nan_beside() -> None:
    surface = ball(10.0, 12, 16)
    weight = np.random.default_rng(1).dirichlet(np.ones(3), (20, len(surface.faces)))
    at = np.einsum("ntk,tkx->ntx", weight, surface.corners)
    down = surface.normals[:, 1] < -1e-6
    found = surface.height(at[:, down, 0], at[:, down, 2])
    assert np.abs(found - at[:, down, 1]).max() < 1e-13 * 10
    up = surface.normals[:, 1] > 1e-6
    assert np.abs(surface.height(at[:, up, 0], at[:, up, 2], lowest=False) - at[:, up, 1]).max() < 1e-13 * 10
    assert np.isnan(surface.height(np.array([10.5, 0.0]), np.array([0.0, -11.0]))).all()


def test_no_line_slips_through_between_triangles() -> None:
    surface = ball(10.0, 31, 37)
    nodes = surface.points[surface.points[:, 1] < -0.1]
    edges = surface.points[surface.faces[:, [0, 1]]].mean(axis=1)
    at = np.vstack([nodes, edges[edges[:, 1] < -0.1]])
    assert np.abs(surface.height(at[:, 0], at[:, 2]) - at[:, 1]).max() < 1e-9


def test_the_lowest_of_several_surfaces_is_met() -> None:
    upside_down = channel(10.0, 4.0, 2.0, 5.0)
    x = np.array([-6.0, 0.0, 6.0])
    np.testing.assert_allclose(upside_down.height(x, 0.0 * x), [0.0, 4.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(upside_down.height(x, 0.0 * x, lowest=False), 6.0, atol=1e-14)


def test_signed_distance_of_a_box_is_exact_near_faces_edges_and_corners() -> None:
    p = np.random.default_rng(2).uniform(-4, 4, (5000, 3))
    distance, normal = box(2, 3, 4).signed_distance(p)
    q = np.abs(p) - [1.0, 1.5, 2.0]
    outside = np.maximum(q, 0.0)
    exact = np.linalg.norm(outside, axis=1) + np.minimum(q.max(axis=1), 0.0)
    assert np.abs(distance - exact).max() < 1e-13
    far = np.linalg.norm(outside, axis=1) > 1e-6
    gradient = np.sign(p) * outside / np.linalg.norm(outside, axis=1, keepdims=True).clip(1e-300)
    assert np.abs(normal - gradient)[far].max() < 1e-9
    assert np.abs(np.linalg.norm(normal, axis=1) - 1.0).max() < 1e-12


def test_inside_and_outside_at_a_vertex_where_the_nearest_triangles_normal_errs() -> None:
    # A needle: beside its tip the nearest triangle may be one that faces away (Baerentzen and Aanaes 2005).
    points = np.array([[0.0, 0.0, 0.0], [1.0, 10.0, 0.0], [-0.5, 10.0, 0.8], [-0.5, 10.0, -0.8]])
    needle = Triangles(points, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]))
    assert mistake(needle) == ""
    direction = np.random.default_rng(3).normal(size=(4000, 3))
    below = direction / np.linalg.norm(direction, axis=1)[:, None] * 0.05
    below = below[below[:, 1] < -0.01]
    distance, normal = needle.signed_distance(below)
    assert (distance > 0.0).all()
    nearest_is_tip = np.einsum("ij,kj->ik", below, points[1:]).max(axis=1) < 0.0
    assert nearest_is_tip.any()
    np.testing.assert_allclose(distance[nearest_is_tip], 0.05, rtol=1e-12)
    np.testing.assert_allclose(normal[nearest_is_tip], below[nearest_is_tip] / 0.05, atol=1e-9)
    on_the_tip = needle.signed_distance(points[:1])
    assert on_the_tip[0][0] == 0.0
    assert on_the_tip[1][0, 1] < -0.9


def test_distance_agrees_with_every_triangle_tried() -> None:
    surface = ball(3.0, 9, 11)
    big = box(40.0, 1.0, 40.0, (0.0, 6.0, 0.0))
    both = Triangles(
        np.vstack([surface.points, big.points]), np.vstack([surface.faces, big.faces + len(surface.points)])
    )
    p = np.random.default_rng(4).uniform(-8, 8, (300, 3))
    near = both.closest(p)[0]
    tried = np.min(
        [np.linalg.norm(p - Triangles(both.points, f[None]).closest(p)[0], axis=1) for f in both.faces], axis=0
    )
    assert np.abs(np.linalg.norm(p - near, axis=1) - tried).max() < 1e-12


def test_ten_thousand_points_on_a_hundred_thousand_triangles(large: Triangles) -> None:
    assert len(large.faces) >= 100_000
    rng = np.random.default_rng(5)
    direction = rng.normal(size=(10_000, 3))
    p = direction / np.linalg.norm(direction, axis=1)[:, None] * rng.uniform(9.0, 11.0, (10_000, 1))
    distance, _ = large.signed_distance(p)
    height = large.height(p[:, 0], p[:, 2])
    assert np.abs(distance - np.linalg.norm(p, axis=1) + 10.0).max() < 2e-3
    inside = np.hypot(p[:, 0], p[:, 2]) < 9.0
    assert np.abs(height + np.sqrt(np.maximum(100.0 - p[:, 0] ** 2 - p[:, 2] ** 2, 0.0)))[inside].max() < 5e-3


def test_equality_is_by_content() -> None:
    assert box(1, 2, 3) == box(1, 2, 3)
    assert box(1, 2, 3) != box(1, 2, 3.1)
    assert len({box(1, 2, 3), box(1, 2, 3)}) == 1


def test_the_sharpest_edge_of_a_box_is_square_and_that_of_a_fine_ball_is_flat() -> None:
    assert box(2, 3, 4).sharpest_edge == pytest.approx(np.pi / 2, rel=1e-12)
    # facets of 180 / 40 = 4.5 degrees along the meridians
    assert ball(3.0, 40, 80).sharpest_edge == pytest.approx(np.radians(4.5), rel=0.05)
