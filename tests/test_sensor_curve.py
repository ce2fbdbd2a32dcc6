"""A calibration curve: fit, resolution, usable range and shares of the tolerances."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.sensor import Calibration, Tolerance, estimate
from tests.sensor_cases import curve, saturating, straight, turning


def test_the_papers_numbers_a_slope_of_15e_4_and_a_noise_of_15e_5_give_a_tenth() -> None:
    """Maeno 2004, Sec. IV: 1.5e-4 of strain makes 0.1 of mu, so the slope is 1.5e-3."""
    found = curve(straight)
    assert found.resolution(0.5) == pytest.approx(0.1, rel=1e-9)


def test_the_fit_is_second_order_and_its_residual_is_what_it_leaves() -> None:
    exact = curve(lambda mu: 0.02 - 0.01 * mu + 0.003 * mu**2)
    assert exact.fit.coefficients == pytest.approx((0.02, -0.01, 0.003), rel=1e-9)
    assert exact.fit.largest < 1e-15
    bump = curve(lambda mu: 0.02 - 0.01 * mu + 1e-4 * np.cos(np.pi * np.arange(25)))
    assert bump.fit.rms == pytest.approx(1e-4, rel=0.05)  # two of three unknowns hardly see an alternating sign


def test_the_interpolation_error_bounds_what_pchip_misses() -> None:
    found = curve(saturating)
    mu = np.linspace(0.02, 1.2, 2001)
    missed = np.abs(found.at(mu) - saturating(mu))
    assert np.sqrt(np.mean(missed**2)) <= 1.5 * found.interpolation_error
    assert found.interpolation_error < 1e-5


def test_usable_range_ends_where_the_slope_drowns_in_noise() -> None:
    """|d strain / d mu| = .04 exp(-4 mu) is noise / limit = 1.5e-3 at mu = ln(.04 / .0015) / 4."""
    best = curve(saturating).usable[0]
    assert best.low == pytest.approx(0.02)
    assert best.high == pytest.approx(math.log(0.04 / 0.0015) / 4.0, abs=0.02)  # PCHIP's slope between points
    assert best.elsewhere == ()


def test_a_curve_that_turns_has_two_ranges_that_share_their_strains() -> None:
    found = curve(turning)
    assert len(found.usable) == 2
    assert found.usable[0].elsewhere


def test_the_range_with_all_tolerances_is_where_their_error_leaves_mu_within_the_limit() -> None:
    mu = np.linspace(0.0, 1.0, 21)
    # strain falls by .1 a unit of mu; a tolerance of .02 in strain at mu = 0, none at 1: within .1 from mu = .5 on
    tolerance = Tolerance("depth_mm", "mm", 1.0, np.zeros(21), 0.02 * (1.0 - mu))
    found = Calibration("g", mu, 0.2 - 0.1 * mu, 1e-6, 0.1, (tolerance,))
    (stretch,) = found.trusted
    assert (stretch.low, stretch.high) == pytest.approx((0.5, 1.0), abs=0.01)
    assert (found.usable[0].low, found.usable[0].high) == (0.0, 1.0)
    assert "mu = 0.5 to 1" in found.verdict()


def test_a_flat_curve_has_no_usable_range() -> None:
    found = curve(lambda mu: 0.03 + 0.0 * mu)
    assert found.usable == ()
    assert "no usable" in found.verdict()
    assert estimate(found, 0.03)[0].status == "blind"
    assert "0.02 to 1.2 " in estimate(found, 0.03)[0].verdict


def test_shares_sum_to_one() -> None:
    found = curve(straight, tolerances=(Tolerance("depth_mm", "mm", 0.1, np.full(25, 1e-3), np.full(25, 1e-4)),))
    shares = found.shares(0.5)
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares["depth_mm"] == pytest.approx(1e-8 / (1e-8 + 2.25e-8), rel=1e-6)


def test_two_answers_of_a_monotone_curve_are_blamed_on_what_is_not_known() -> None:
    error = 0.06 * np.linspace(0.02, 1.2, 25) ** 4
    wide = Tolerance("mesh", "error bar", 1.0, error, error)
    found = curve(lambda mu: 0.1 * np.exp(-2.0 * mu), tolerances=(wide,))
    (answer,) = estimate(found, 0.05)
    assert answer.status == "ambiguous"
