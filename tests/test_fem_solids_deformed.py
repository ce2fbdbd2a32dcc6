"""Stretch along a direction in a deformed body."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import quadratic
from finger3d.fem.solids.deformed import stretch
from tests.meshes import grid


def test_a_uniform_deformation_stretches_every_direction_by_its_gradient() -> None:
    mesh = quadratic(grid((2, 2)))
    slope = np.array([[0.3, 0.1], [-0.2, -0.1]])
    u = mesh.points @ slope.T
    for angle in (0.0, 0.7, 2.0):
        direction = np.array([np.cos(angle), np.sin(angle)])
        expected = np.linalg.norm(direction + slope @ direction) - 1.0
        assert stretch(mesh, u, np.array([0.4, 0.6]), direction) == pytest.approx(expected, rel=1e-12)
