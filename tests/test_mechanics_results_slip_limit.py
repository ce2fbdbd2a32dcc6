"""Slip limit of a contact, against Coulomb's law for a flat one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.results.slip_limit import slip_limit
from finger3d.objects import Plane
from tests.held_cases import MU, PRESS, N, held
from tests.models import block


def test_the_slip_limit_of_a_flat_contact() -> None:
    """mu N along every axis; mu times the pressure's first moment about its centre."""
    problem = build(block(object=Plane(), legs=(PRESS, held(0.03, 0.04 * 0.5))))
    *_, last = march(problem)
    limit = slip_limit(problem.points, last.state, problem.model.friction)
    assert limit is not None
    assert limit.tangential_force_x_N == pytest.approx(MU * N, rel=1e-9)
    assert limit.tangential_force_z_N == pytest.approx(MU * N, rel=1e-9)
    p, x, z = last.state.force[:, 0], problem.points.points[:, 0], problem.points.points[:, 2]
    arm = np.hypot(x - p @ x / p.sum(), z - p @ z / p.sum())
    assert limit.moment_y_Nmm == pytest.approx(MU * p @ arm, rel=1e-9)
    assert np.hypot(0.03, 0.02) / (MU * N) <= limit.used < 1.0


def test_a_wall_across_x_has_no_friction_along_x() -> None:
    problem = build(block(object=Plane(), legs=(PRESS,), domain="plane-strain"))
    *_, last = march(problem)
    walls = np.tile(np.eye(2), (len(problem.points.points), 1, 1))  # normals along x, tangents along y
    limit = slip_limit(replace(problem.points, basis=walls), replace(last.state, bases=None), problem.model.friction)
    assert limit is not None
    assert limit.tangential_force_x_N == 0.0
    assert limit.used == 0.0
