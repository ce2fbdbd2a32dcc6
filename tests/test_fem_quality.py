"""Angles and Jacobians of cells."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.fem.quality import cell_angles_deg


def test_cell_angles_of_known_cells() -> None:
    corner = np.vstack([np.zeros(3), np.eye(3)])
    assert cell_angles_deg(corner, np.array([[0, 1, 2, 3]]))[0] == pytest.approx(math.degrees(math.acos(3**-0.5)))
    assert cell_angles_deg(corner, np.array([[1, 0, 2, 3]]))[0] == 0.0
    assert cell_angles_deg(corner[:3, :2], np.array([[0, 1, 2]]))[0] == pytest.approx(45.0)
