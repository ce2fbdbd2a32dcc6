"""Gauges read the field of strain."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.recovery.recover import displacement
from finger3d.fem.surface.traces import displacement_row
from finger3d.mechanics.model import Gauge
from tests.models import block, run


def test_gauge_reads_the_field_without_recovering_it() -> None:
    at, angle = (0.93, 1.41, 0.57), 0.4  # inside a cell
    gauges = (
        Gauge("point", *at, angle),
        Gauge("mirror", -at[0], at[1], -at[2], np.pi - angle),
        Gauge("short", *at, angle, 1e-3),
        Gauge("long", 0.0, 1.5, 0.0, 0.0, 2.0),
    )
    problem, frames = run(block(gauges=gauges))
    read = frames[-1].gauges
    assert read["point"] == pytest.approx(read["mirror"], rel=1e-12)
    assert read["point"] == pytest.approx(read["short"], rel=1e-6)
    u = displacement(problem.mesh, problem.unknowns(problem.upright_force(frames[-1].meshed_state.contact)))
    row = displacement_row(problem.mesh, np.array([1.0, 1.5, 0.0]), np.array([1.0, 0.0, 0.0]))
    assert read["long"] == pytest.approx((row @ u.ravel())[0], rel=1e-9)  # elongation 2 u_x(1) over length 2
