"""A calibration curve: second-order fit, resolution, and error of the interpolation, which is monotone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from finger3d.sensor.curve import MonotoneCubic
from tests.sensor_cases import curve, saturating, straight


def test_the_interpolation_is_that_of_scipy() -> None:
    random = np.random.default_rng(0)
    for _ in range(300):
        count = random.integers(2, 9)
        x, y = np.cumsum(random.uniform(0.1, 2.0, count)), random.normal(size=count) * random.choice([0, 1, 1], count)
        at = random.uniform(x[0], x[-1], 20)
        found, wanted = MonotoneCubic.of(x, y), PchipInterpolator(x, y)
        assert found(at) == pytest.approx(wanted(at), rel=1e-12, abs=1e-12)
        assert found(at, 1) == pytest.approx(wanted(at, 1), rel=1e-9, abs=1e-9)


def test_the_papers_numbers_a_slope_of_15e_4_and_a_noise_of_15e_5_give_a_tenth() -> None:
    """Maeno 2004, Sec. IV: 1.5e-4 of strain makes 0.1 of mu, so the slope is 1.5e-3."""
    found = curve(straight)["g"]
    assert found.resolution(0.5) == pytest.approx(0.1, rel=1e-9)


def test_the_fit_is_second_order_and_its_residual_is_what_it_leaves() -> None:
    exact = curve(lambda mu: 0.02 - 0.01 * mu + 0.003 * mu**2)["g"]
    assert exact.fit.coefficients == pytest.approx((0.02, -0.01, 0.003), rel=1e-9)
    assert exact.fit.largest < 1e-15
    bump = curve(lambda mu: 0.02 - 0.01 * mu + 1e-4 * np.cos(np.pi * np.arange(25)))["g"]
    assert bump.fit.rms == pytest.approx(1e-4, rel=0.05)  # two of three unknowns hardly see an alternating sign


def test_the_interpolation_error_bounds_what_pchip_misses() -> None:
    found = curve(saturating)["g"]
    mu = np.linspace(0.02, 1.2, 2001)
    missed = np.abs(found.at(mu) - saturating(mu))
    bound = np.sqrt(np.mean(found.curve_error(found.mu[1:-1]) ** 2))
    assert np.sqrt(np.mean(missed**2)) <= 1.5 * bound
    assert bound < 1e-5
