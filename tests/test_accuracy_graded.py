"""Meshes graded towards one number."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.accuracy.adjoint_bars import adjoint_bars
from finger3d.accuracy.graded import graded_sizes
from tests.models import half_cylinder, run


@pytest.mark.parametrize("goal", ["normal_force_N", "gauge_g"])
def test_a_smaller_error_asks_for_edges_that_are_nowhere_longer(goal: str) -> None:
    problem, frames = run(half_cylinder(0.3, 3))
    bars = adjoint_bars(problem, frames)
    error = bars.bars[goal]
    rough, fine = (graded_sizes(problem, bars, goal, share * error) for share in (2.0, 0.1))
    assert rough.grading is not None
    assert fine.grading is not None
    assert (fine.grading.sizes <= rough.grading.sizes * (1.0 + 1e-12)).all()
    assert fine.grading.sizes.sum() < 0.8 * rough.grading.sizes.sum()
    assert fine.size_mm <= rough.size_mm
    # edges change by a bounded factor in one round, and do not exceed half the body
    assert rough.base_size_mm >= rough.size_mm
    assert fine.size_mm >= 0.35 * problem.model.mesh.size_mm * (1.0 - 1e-12)
    assert rough.grading.sizes.max() <= 0.5 * problem.model.design.height_mm
    assert np.isfinite(fine.grading.sizes).all()
