"""Posterior distribution of fitted values: normal, flat, or with two maxima."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.identify.posterior import FittedValues, fitted_values, sampled

SCALES = [FreeKey("friction.mu", 0.0, 1.0), FreeKey("material.E_MPa", 0.0, 2.0)]
COUNT = 4096
"""Samples; the error of a standard deviation is about 1 / sqrt(2 n) = 0.011 of it."""


def fitted(response: Callable[[Any], Any], shares: Any, noise: float = 0.01, scales: Any = SCALES) -> FittedValues:
    """Values at shares (k,), from readings (s, n) of a response to shares (s, k), with independent noise."""
    data = response(np.array([shares]))

    def residuals(at: Any) -> Any:
        return (response(at) - data) / noise

    samples = sampled(lambda at: -0.5 * np.sum(residuals(at) ** 2, axis=1), len(shares), COUNT)
    steps = 1e-6 * np.eye(len(shares))
    slope = (residuals(shares + steps) - residuals(shares - steps)).T / 2e-6
    return fitted_values(scales, np.array(shares), samples, slope, np.zeros((len(slope), len(slope))))


def linear(matrix: Any) -> Callable[[Any], Any]:
    return lambda shares: shares @ np.transpose(matrix)


def test_a_straight_response_has_a_normal_distribution() -> None:
    matrix = np.array([[1.0, 0.3], [0.2, 1.0], [0.5, 0.5]])
    found = fitted(linear(matrix), [0.4, 0.5])
    covariance = 1e-4 * np.linalg.inv(matrix.T @ matrix)
    sd = np.sqrt(np.diag(covariance))
    assert found.stds == pytest.approx(sd * [1.0, 2.0], rel=0.05)
    assert found.low == pytest.approx([0.4 - sd[0], 1.0 - 2.0 * sd[1]], abs=1e-3)
    assert found.correlation[0, 1] == pytest.approx(covariance[0, 1] / sd[0] / sd[1], abs=0.05)
    assert found.untold == ()


def test_samples_find_a_peak_a_thousandth_of_the_range_wide() -> None:
    found = fitted(linear(np.eye(3)), [0.31, 0.77, 0.5], 1e-3, [FreeKey(name, 0.0, 1.0) for name in "abc"])
    assert found.stds == pytest.approx([1e-3] * 3, rel=0.06)


def test_an_interval_is_one_deviation_of_the_share_to_both_sides() -> None:
    """On a logarithmic scale it is longer above the value than below, and it ends at the bounds."""
    scales = [FreeKey("a", 1.0, 100.0), FreeKey("b", 0.0, 1.0)]
    assert scales[0].is_logarithmic
    assert scales[0].share(scales[0].value(0.3)) == pytest.approx(0.3)
    found = fitted(linear(np.eye(2)), [0.5, 1.0], 0.05, scales)
    assert found.low[0] == pytest.approx(10.0 * 100.0**-0.05, rel=0.02)  # 1/12 of a deviation
    assert found.high == pytest.approx([10.0 * 100.0**0.05, 1.0], rel=0.02)
    # of the half of a normal distribution below the bound, 84 % are within 1.41 deviations
    assert found.low[1] == pytest.approx(1.0 - 1.41 * 0.05, abs=4e-3)
    assert "b is at its upper bound: widen it" in found.untold


def test_the_part_of_the_errors_of_the_simulation() -> None:
    """An error of 3 deviations in the only reading of the first value, none in that of the second."""
    scales, root = [FreeKey("a", 0.0, 1.0), FreeKey("b", 0.0, 2.0)], math.sqrt(10.0)
    slope = np.diag([1e3 / root, 1e3])
    samples = sampled(lambda at: -0.5 * np.sum(((at - 0.5) @ slope) ** 2, axis=1), 2, COUNT)
    found = fitted_values(scales, np.array([0.5, 0.5]), samples, slope, np.diag([0.9, 0.0]))
    assert found.numerical == pytest.approx([3e-3, 0.0], rel=0.05)
    assert found.stds == pytest.approx([math.hypot(1e-3, 3e-3), 2e-3], rel=0.05)


def test_values_that_only_their_sum_is_told_of() -> None:
    scales = [FreeKey("a", 0.0, 1.0), FreeKey("b", 1.0, 100.0)]
    told = fitted(linear([[1.0, 1.0], [0.5, 0.5]]), [0.5, 0.5], scales=scales)
    assert any("apart: they may change against each other" in note for note in told.untold)


def test_where_friction_ceases_to_change_a_reading_the_interval_reaches_the_bound() -> None:
    """Beyond mu = 0.3 all sticks: a fit that ends there has an equal likelihood up to the bound."""
    found = fitted(lambda at: np.stack([np.minimum(at[:, 0], 0.3), at[:, 1], 0.0 * at[:, 0]], axis=1), [0.35, 0.5])
    # a uniform distribution from 0.3 to 1 has 84 % below 0.89, and a root mean square distance of 0.36 from 0.35
    assert found.low[0] == pytest.approx(0.35)
    assert found.high[0] == pytest.approx(0.89, abs=0.02)
    assert found.stds[0] == pytest.approx(0.36, abs=0.02)
    assert "the data do not bound friction.mu from above" in found.untold


def test_a_flat_likelihood_is_told() -> None:
    found = fitted(lambda at: at[:, 1:], [0.5, 0.5])
    assert "the data cannot tell friction.mu within its bounds" in found.untold


def test_two_maxima_are_told_and_the_deviation_of_all_values_spans_them() -> None:
    """The first reading has the same value at mu and 0.9 - mu; the modulus that goes with it differs."""
    found = fitted(lambda at: np.stack([(at[:, 0] - 0.45) ** 2, at[:, 1] + 0.2 * at[:, 0]], axis=1), [0.2, 0.5], 0.003)
    assert found.stds[0] == pytest.approx(0.5 / math.sqrt(2.0), rel=0.1)
    assert found.stds[1] == pytest.approx(2.0 * 0.2 * 0.5 / math.sqrt(2.0), rel=0.1)
    assert any("fit about as well" in note for note in found.untold)
