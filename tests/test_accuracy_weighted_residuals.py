"""Errors of the body's mesh by dual-weighted residuals."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.accuracy.weighted_residuals import BodyErrors, body_errors
from tests.models import half_cylinder, run


def test_a_gauges_own_cells_add_as_squares() -> None:
    errors = BodyErrors({"normal_force_N": -0.3, "gauge_g": 0.03}, {"gauge_g": 0.04}, {}, {})
    assert errors.bar("normal_force_N") == 0.3
    assert errors.bar("gauge_g") == pytest.approx(0.05)


def test_shares_of_the_cells_make_up_the_error_and_that_of_the_energy_falls_at_the_rate_of_its_corners() -> None:
    works = []
    for size in (0.4, 0.1):
        problem, frames = run(half_cylinder(size, 3))
        found = body_errors(problem, frames)
        assert found.shares["normal_force_N"].sum() == pytest.approx(found.signed["normal_force_N"], rel=1e-12)
        assert found.shares["normal_force_N"].shape == (len(problem.mesh.cells),)
        assert set(found.local) == {"gauge_g"}
        works.append(found.signed["external_work_mJ"])
    # a discretised body is too stiff
    assert min(works) > 0.0
    # Williams' exponent of a bonded right-angled corner is about 0.6, and the error of an energy falls with twice that
    assert np.log2(works[0] / works[1]) / 2.0 == pytest.approx(1.2, abs=0.15)
