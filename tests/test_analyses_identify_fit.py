"""The fit of a response to measured values, and its intervals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.identify.fit import Scale, uncertainty


def test_an_interval_follows_a_response_that_saturates() -> None:
    """Steep below 0.5, flat above: the sum of squares rises by one at 0.49 and at the upper bound."""
    scales = [Scale("a", 0.0, 1.0)]
    steep = np.array([[100.0]])
    found = uncertainty(
        scales, np.array([0.5]), steep, lambda values: np.array([100.0 * min(float(values[0]) - 0.5, 0.0)])
    )
    assert found.low[0] == pytest.approx(0.49, abs=1e-3)
    assert found.high[0] == 1.0


def test_an_error_of_the_simulation_shifts_the_values_and_correlates_them() -> None:
    scales = [Scale("a", 0.0, 1.0), Scale("b", 0.0, 2.0)]
    slope = np.diag([100.0, 400.0])
    found = uncertainty(
        scales, np.array([0.5, 0.5]), slope, lambda v: slope @ (np.array([v[0], 0.5 * v[1]]) - np.array([0.5, 0.5]))
    )
    # an error of 3 deviations in both residuals: 3 / 100 of a, and 3 / 400 of the range of b
    with_error = found.with_errors(scales, slope, np.array([[3.0, 3.0]]))
    assert with_error.numerical == pytest.approx([0.03, 0.015], rel=2e-3)
    assert with_error.stds == pytest.approx(np.hypot(found.stds, with_error.numerical))
    assert with_error.correlation[0, 1] == pytest.approx(9.0 / 10.0, rel=2e-2)
    assert with_error.high[0] - with_error.values[0] == pytest.approx(np.hypot(0.01, 0.03), rel=1e-2)


def test_dependent_and_independent_values() -> None:
    scales = [Scale("a", 0.0, 1.0), Scale("b", 1.0, 100.0)]
    assert scales[1].is_logarithmic
    assert scales[1].share(scales[1].value(0.3)) == pytest.approx(0.3)
    only_sum = np.array([[100.0, 100.0], [50.0, 50.0]])

    def linear(slope: Any) -> Any:
        return lambda values: slope @ np.array([s.share(v) - 0.5 for s, v in zip(scales, values, strict=True)])

    told = uncertainty(scales, np.array([0.5, 0.5]), only_sum, linear(only_sum))
    assert len(told.untold) == 1
    assert "a and b" in told.untold[0]
    good = uncertainty(scales, np.array([0.5, 0.5]), np.diag([100.0, 200.0]), linear(np.diag([100.0, 200.0])))
    assert good.untold == ()
    # 1 / 100 of the range, and 1 / 200 of the logarithmic range times the value 10
    assert good.stds == pytest.approx([0.01, 0.005 * 10.0 * math.log(100.0)], rel=1e-2)
