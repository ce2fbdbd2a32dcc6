"""Slip limit of a contact, against Coulomb's law for a flat one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.mechanics.results.slip_limit import slip_limit
from finger3d.objects import Plane
from tests.models import block

N, MU = 0.2, 0.25
PRESS = Leg(0.2, steps=2, force_N=N, duration_s=1.0)


def held(force_x: float, force_z: float | None = None, **changes: object) -> Leg:
    return replace(PRESS, force_x_N=force_x, force_z_N=force_z, **changes)


def pressed(model: Model) -> tuple[list[StepResult], list[dict[str, float]]]:
    problem = build(replace(model, friction=Coulomb(MU) if type(model.friction) is Coulomb else model.friction))
    steps = list(march(problem))
    return steps, [measure(problem.points, step) for step in steps]


def numbers(model: Model) -> list[dict[str, float]]:
    steps, out = pressed(model)
    assert all(step.outcome.ok and step.residual <= 1e-8 for step in steps), steps[-1].detail
    return out


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
