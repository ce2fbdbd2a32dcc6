"""Contact of a deformed body: turned compliances, and the curvature of the object."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.finite_strain.state import contact_of, curvature_of
from finger3d.mechanics.model import MeshOptions
from finger3d.objects import ObjectPose, Plane
from tests.models import block

COARSE = MeshOptions(1.5, 1.5, "swept")


def test_the_curvature_of_a_ball_is_one_over_the_distance_from_its_centre() -> None:
    problem, pose = build(block(mesh=COARSE)), ObjectPose(0.1, 0.2)
    u = 0.01 * np.random.default_rng(0).normal(size=problem.mesh.points.shape)
    found = curvature_of(problem, problem.surface, u, pose)
    assert found is not None
    at = problem.surface.samples + problem.surface.interpolate @ u
    centre = np.array([0.2, problem.system.first_contact_mm - 0.1 + 4.0, 0.0])
    out = at - centre
    distance = np.linalg.norm(out, axis=1)[:, None, None]
    normal = out[:, :, None] / distance
    # of differences over a tenth of an edge to both sides, which lie on a tangent
    radius = np.hypot(distance, 0.1 * COARSE.size_mm)
    assert found == pytest.approx((np.eye(3) - normal * np.swapaxes(normal, 1, 2)) / radius, abs=1e-9)


def test_a_plane_has_no_curvature_and_the_gap_at_rest_is_its_height() -> None:
    problem = build(block(mesh=COARSE, object=Plane()))
    u = np.zeros_like(problem.mesh.points)
    assert curvature_of(problem, problem.surface, u, ObjectPose(0.0)) is None
    contact = contact_of(problem, problem.surface, u, ObjectPose(0.25))
    assert contact.gap == pytest.approx(np.full(len(contact.gap), -0.25), abs=1e-9)
