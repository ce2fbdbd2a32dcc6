"""Uncertainty of fitted values: normal, or along friction where the likelihood is flat or has two maxima."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.identify.fit import Scale
from finger3d.analyses.identify.posterior import FittedValues, along_friction, fitted_values, normal
from finger3d.errors import Finger3dError

NO_ERRORS = np.zeros((1, 2))


def uncertainty(scales: Any, shares: Any, derivative: Any, errors: Any) -> FittedValues:
    """Values of a linear response with independent errors (m, n) of the simulation, in deviations of the noise."""
    root = np.linalg.cholesky(np.eye(len(derivative)) + errors.T @ errors)
    derivative, errors = np.linalg.solve(root, derivative), np.linalg.solve(root, errors.T)
    return fitted_values(scales, shares, derivative, errors @ errors.T, normal(shares, derivative), None)


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


def test_an_error_of_the_simulation_shifts_the_values_and_correlates_them() -> None:
    scales, slope = [Scale("a", 0.0, 1.0), Scale("b", 0.0, 2.0)], np.diag([1e3, 4e3])
    # an error of 3 deviations in both residuals: 3 / 1000 of a, and 3 / 4000 of the range of b
    found = uncertainty(scales, np.array([0.5, 0.5]), slope, np.array([[3.0, 3.0]]))
    assert found.numerical == pytest.approx([0.003, 0.0015], rel=2e-3)
    assert found.stds == pytest.approx(np.hypot([0.001, 0.0005], found.numerical), rel=1e-3)
    assert found.correlation[0, 1] == pytest.approx(9.0 / 10.0, rel=2e-2)
    assert found.high[0] - found.values[0] == pytest.approx(np.hypot(0.001, 0.003), rel=1e-2)


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


SCALES = [Scale("friction.mu", 0.0, 1.0), Scale("material.E_MPa", 0.0, 2.0)]


def along(response: Any, shares: Any, at: float, noise: float = 0.01) -> tuple[Any, FittedValues]:
    """Values at shares (2,), from readings of a response of both shares, with noise; read at a true mu of `at`."""
    data = response(at, 0.5)

    def residuals(share: Any) -> Any:
        return (response(*share) - data) / noise

    def derivative(share: Any) -> Any:
        steps = 1e-6 * np.eye(2)
        return np.array([(residuals(share + h) - residuals(share - h)) / 2e-6 for h in steps]).T

    slope = derivative(shares)
    mixture = along_friction(shares, slope, 0, lambda share: (residuals(share), derivative(share)[:, 1:]))
    return mixture, fitted_values(SCALES, shares, slope, np.zeros((len(data), len(data))), mixture, 0)


def test_a_straight_response_has_the_normal_distribution() -> None:
    matrix = np.array([[1.0, 0.3], [0.2, 1.0], [0.5, 0.5]])
    shares = np.array([0.4, 0.5])
    mixture, found = along(lambda a, b: matrix @ [a, b], shares, 0.4)
    wanted = fitted_values(SCALES, shares, 100.0 * matrix, np.zeros((3, 3)), normal(shares, 100.0 * matrix), None)
    assert found.stds == pytest.approx(wanted.stds, rel=0.01)
    assert found.low == pytest.approx(wanted.low, abs=2e-4)
    assert found.correlation == pytest.approx(wanted.correlation, abs=0.02)


def test_where_friction_ceases_to_change_a_reading_the_interval_reaches_the_bound() -> None:
    """Beyond mu = 0.3 all sticks: a fit that ends there has an equal likelihood up to the bound."""
    _, found = along(lambda a, b: np.array([min(a, 0.3) + 0.01 * a, b, a * 1e-3]), np.array([0.35, 0.5]), 0.35)
    assert found.low[0] == pytest.approx(0.35)  # 84 % lie above 0.41
    # a uniform distribution from 0.3 to 1 has 84 % below 0.89, and a root mean square distance of 0.36 from 0.35
    assert found.high[0] == pytest.approx(0.89, abs=0.03)
    assert found.stds[0] == pytest.approx(0.36, abs=0.03)
    assert any("cannot tell friction.mu" in note for note in found.untold)


def test_two_maxima_are_told_and_the_deviation_of_all_values_spans_them() -> None:
    """The first reading has the same value at mu and 0.9 - mu; the modulus that goes with it differs."""
    _, found = along(lambda a, b: np.array([(a - 0.45) ** 2, b + 0.2 * a]), np.array([0.2, 0.5]), 0.2, 0.003)
    assert found.stds[0] == pytest.approx(0.5 / math.sqrt(2.0), rel=0.05)
    assert found.stds[1] == pytest.approx(2.0 * 0.2 * 0.5 / math.sqrt(2.0), rel=0.05)
    assert any("fit about as well" in note for note in found.untold)


def test_presses_that_fail_end_the_range_of_the_likelihood() -> None:
    def press(share: Any) -> Any:
        if share[0] > 0.7:
            raise Finger3dError("it slips")
        return np.array([0.0, 0.0]), np.array([[0.0], [10.0]])

    shares, derivative = np.array([0.4, 0.5]), np.array([[0.0, 0.0], [0.0, 10.0]])
    mixture = along_friction(shares, derivative, 0, press)
    assert mixture.shares[:, 0].max() <= 0.7
    assert mixture.weight.sum() == pytest.approx(1.0)
