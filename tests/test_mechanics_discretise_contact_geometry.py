"""Gaps and directions of contact points from the signed distance of an object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import CONTACT, FREE_FACES, quadratic
from finger3d.fem.surface.traces import BoundarySurface, surface
from finger3d.mechanics.discretise.contact_geometry import contact_geometry, may_touch
from tests.meshes import grid


def top(dim: int) -> BoundarySurface:
    return surface(quadratic(grid((4,) * dim)), "y+")


@pytest.mark.parametrize("dim", [2, 3])
def test_the_gap_to_a_plane_is_exact_wherever_the_points_go(dim: int) -> None:
    face, rng = top(dim), np.random.default_rng(0)
    normal = np.eye(dim)[0] * 0.6 - np.eye(dim)[1] * 0.8
    moved = rng.normal(size=face.points.shape)
    made = contact_geometry(lambda at: (at @ normal + 1.2, np.tile(normal, (len(at), 1))), face, moved)
    assert made.gap == pytest.approx((face.centroids + moved) @ normal + 1.2, rel=1e-12)
    assert np.allclose(made.bases[:, 0], normal)
    assert np.allclose(made.gradient, normal)


def test_the_normal_of_a_ball_is_the_mean_direction_to_its_centre() -> None:
    face, centre, radius = top(3), np.array([0.5, 3.0, 0.5]), 1.5

    def ball(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        out = at - centre
        distance = np.linalg.norm(out, axis=1)
        return distance - radius, out / distance[:, None]

    made = contact_geometry(ball, face)
    wanted = face.centroids - centre
    wanted /= np.linalg.norm(wanted, axis=1)[:, None]
    # hats are 0.25 mm to each side, and the ball is 2 mm away: the mean is off by the square of their ratio
    assert made.bases[:, 0] == pytest.approx(wanted, abs=0.25**2 / 2.0**2)
    assert (made.slope < 1.0).all()
    assert made.angles(made) == pytest.approx(np.zeros(len(wanted)))


def test_normals_on_a_symmetry_plane_lie_in_it() -> None:
    face, normal = top(3), np.array([0.6, -0.8, 0.0])
    made = contact_geometry(lambda at: (at @ normal, np.tile(normal, (len(at), 1))), face, axes=("x",))
    on_plane = face.points[:, 0] == 0.0
    assert np.allclose(made.bases[on_plane, 0], [0.0, -1.0, 0.0])
    assert np.allclose(made.bases[~on_plane, 0], normal)


def test_an_object_as_soft_as_the_finger_meets_it_half_way() -> None:
    face, tilt = top(2), 0.2
    normal = np.array([np.sin(tilt), -np.cos(tilt)])
    made = contact_geometry(
        lambda at: (at @ normal, np.tile(normal, (len(at), 1))), face, object_share=np.full(len(face.points), 0.5)
    )
    assert np.allclose(made.bases[:, 0], [np.sin(tilt / 2.0), -np.cos(tilt / 2.0)])


def test_walls_touch_only_what_they_face() -> None:
    wall = surface(quadratic(grid((2, 2))), "x+")
    below, beside = np.tile([0.0, -1.0], (len(wall.points), 1)), np.tile([-1.0, 0.0], (len(wall.points), 1))
    wall = replace(wall, face=np.full(len(wall.points), FREE_FACES.index("walls"), dtype=np.int8))
    assert not may_touch(wall, below).any()
    assert may_touch(wall, beside).all()
    assert may_touch(replace(wall, face=np.full(len(wall.points), CONTACT, dtype=np.int8)), below).all()
