"""Richardson extrapolation of quantities on two meshes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from finger3d.accuracy.point_resolution import PointResolution
from finger3d.accuracy.richardson import ORDER, mesh_error
from finger3d.mechanics.readings.columns import strain_columns


def test_the_order_is_that_of_the_corners_of_the_base() -> None:
    # Williams 1952: where a held face meets a free one at a right angle, in plane strain and along an edge of a solid,
    # displacements go as r^lambda, sin^2(lambda pi/2) = (4 (1 - nu)^2 - lambda^2)/(3 - 4 nu), forces converge in
    # 2 lambda; at nu = 0.49 that is 1.20
    nu = 0.49
    root = brentq(lambda p: np.sin(p * np.pi / 2) ** 2 - (4 * (1 - nu) ** 2 - p**2) / (3 - 4 * nu), 0.5, 0.8)
    assert pytest.approx(2.0 * root, abs=0.01) == ORDER


def test_an_error_of_the_assumed_order_is_found_exactly() -> None:
    exact, scale = 7.0, 0.3
    fine, coarse = ({"normal_force_N": exact + scale * h**ORDER, "gauge_g": 0.0} for h in (1.0, 2.0))
    # the grain is so fine that its floor, 0.1 * share^2 of the force, lies far below
    found = mesh_error(
        fine, coarse, 2.0, (PointResolution(1e-3, 1e-3), PointResolution(2e-3, 2e-3)), strain_columns("g")
    )
    assert found["normal_force_N"] == pytest.approx(scale, rel=1e-12)


def test_an_error_is_found_exactly_from_a_finer_mesh_too() -> None:
    exact, scale = 7.0, 0.3
    own, finer = ({"normal_force_N": exact + scale * h**ORDER} for h in (1.0, 0.5))
    found = mesh_error(own, finer, 0.5, (PointResolution(1e-3, 1e-3), PointResolution(5e-4, 5e-4)))
    assert found["normal_force_N"] == pytest.approx(scale, rel=1e-12)
