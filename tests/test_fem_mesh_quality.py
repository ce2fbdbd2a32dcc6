"""Angles and Jacobians of cells."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.fem.mesh.quality import cell_angles_deg, most_distorted
from finger3d.fem.mesh.simplex import Mesh, quadratic


def test_cell_angles_of_known_cells() -> None:
    corner = np.vstack([np.zeros(3), np.eye(3)])
    assert cell_angles_deg(corner, np.array([[0, 1, 2, 3]]))[0] == pytest.approx(math.degrees(math.acos(3**-0.5)))
    assert cell_angles_deg(corner, np.array([[1, 0, 2, 3]]))[0] == 0.0
    assert cell_angles_deg(corner[:3, :2], np.array([[0, 1, 2]]))[0] == pytest.approx(45.0)


def test_the_most_distorted_cell_is_that_which_loses_most_volume() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [3.0, 3.0]])
    mesh = quadratic(Mesh(points, np.array([[0, 1, 2], [1, 3, 2]]), {}))
    squeezed = np.where(mesh.points[:, :1] + mesh.points[:, 1:] <= 1.0, [[-0.75, 0.0]], 0.0) * mesh.points
    cell, ratio = most_distorted(mesh, squeezed)
    assert cell == 0
    assert ratio == pytest.approx(0.25)
    assert most_distorted(mesh, 0.0 * squeezed)[1] == pytest.approx(1.0)
