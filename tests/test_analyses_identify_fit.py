"""The fit of a response to measured values, and its intervals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.identify.fit import Scale, fit, foretold, uncertainty

NO_ERRORS = np.zeros((1, 2))


def test_an_interval_is_one_deviation_of_the_share_to_both_sides() -> None:
    """On a logarithmic scale it is longer above the value than below, and it ends at the bounds."""
    scales = [Scale("a", 1.0, 100.0), Scale("b", 0.0, 1.0)]
    found = uncertainty(scales, np.array([0.5, 0.95]), np.diag([10.0, 10.0]), NO_ERRORS)
    sd = 1.0 / math.sqrt(10.0**2 + 12.0)  # beside the data, the bounds tell a uniform distribution
    assert found.low == pytest.approx([10.0 * 100.0**-sd, 0.95 - sd])
    assert found.high == pytest.approx([10.0 * 100.0**sd, 1.0])
    assert found.stds == pytest.approx(
        [10.0 * math.hypot(1.0 - 100.0**-sd, 100.0**sd - 1.0) / math.sqrt(2.0), math.hypot(sd, 0.05) / math.sqrt(2.0)]
    )
    assert not found.numerical.any()


def test_a_fit_takes_the_steps_of_the_linear_problem_and_stays_within_the_bounds() -> None:
    """The minimum of (a - 0.8)^2 + 100 (b + 0.2 - a^2)^2 with b at most 0.3 is found in a few presses."""
    scales, tried = [Scale("a", 0.0, 1.0), Scale("b", 0.0, 0.3)], list[Any]()

    def residuals(values: Any) -> Any:
        tried.append(values)
        return 1e3 * np.array([values[0] - 0.8, 10.0 * (values[1] + 0.2 - values[0] ** 2)])

    def slopes(values: Any) -> Any:
        return 1e3 * np.array([[1.0, 0.0], [-20.0 * values[0], 10.0]])

    shares = fit(scales, np.array([0.1, 0.5]), residuals, slopes, lambda _: None)
    # with b = 0.3, (a - 0.8) - 200 a (0.5 - a^2) = 0
    (a,) = [r.real for r in np.roots([200.0, 0.0, -99.0, -0.8]) if r.real > 0.5]
    assert shares == pytest.approx([a, 1.0], abs=1e-3)  # the last step lowers the sum by less than a thousandth
    assert len(tried) < 12


def test_a_fit_leaves_what_the_data_do_not_determine() -> None:
    scales, seen = [Scale("a", 0.0, 1.0), Scale("b", 0.0, 1.0)], np.array([[100.0, 0.0]])
    shares = fit(scales, np.array([0.1, 0.6]), lambda v: seen @ v - 90.0, lambda _: seen, lambda _: None)
    assert shares == pytest.approx([0.9, 0.6], abs=1e-3)


def test_what_a_step_would_leave_is_foretold() -> None:
    """Within the bounds: b cannot fall below 0; the step over a range counts as one deviation."""
    scales, slope = [Scale("a", 0.0, 1.0), Scale("b", 0.0, 1.0)], np.diag([100.0, 100.0])
    left = foretold(scales, np.array([0.5, 0.2]), lambda v: slope @ v - [20.0, -30.0], lambda _: slope)
    assert left == pytest.approx(30.0**2, rel=1e-3)


def test_an_error_of_the_simulation_shifts_the_values_and_correlates_them() -> None:
    scales, slope = [Scale("a", 0.0, 1.0), Scale("b", 0.0, 2.0)], np.diag([100.0, 400.0])
    # an error of 3 deviations in both residuals: 3 / 100 of a, and 3 / 400 of the range of b
    found = uncertainty(scales, np.array([0.5, 0.5]), slope, np.array([[3.0, 3.0]]))
    assert found.numerical == pytest.approx([0.03, 0.015], rel=2e-3)
    assert found.stds == pytest.approx(np.hypot([0.01, 0.005], found.numerical), rel=1e-3)
    assert found.correlation[0, 1] == pytest.approx(9.0 / 10.0, rel=2e-2)
    assert found.high[0] - found.values[0] == pytest.approx(np.hypot(0.01, 0.03), rel=1e-2)


def test_dependent_and_independent_values() -> None:
    scales = [Scale("a", 0.0, 1.0), Scale("b", 1.0, 100.0)]
    assert scales[1].is_logarithmic
    assert scales[1].share(scales[1].value(0.3)) == pytest.approx(0.3)
    only_sum = np.array([[100.0, 100.0], [50.0, 50.0]])
    told = uncertainty(scales, np.array([0.5, 0.5]), only_sum, NO_ERRORS)
    assert len(told.untold) == 1
    assert "a and b" in told.untold[0]
    good = uncertainty(scales, np.array([0.5, 0.5]), np.diag([100.0, 200.0]), NO_ERRORS)
    assert good.untold == ()
    # 1 / 100 of the range, and 1 / 200 of the logarithmic range times the value 10
    assert good.stds == pytest.approx([0.01, 0.005 * 10.0 * math.log(100.0)], rel=1e-2)
