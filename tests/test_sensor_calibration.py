"""A calibration says of mu what the estimates from it say."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from finger3d.sensor import Calibration, estimate
from finger3d.sensor.calibration import summary
from tests.sensor_cases import curve, kinked, line, saturating, straight, together, tolerance, turning


def gauge() -> Calibration:
    """A strain that falls and flattens, with an error that grows with mu, as that of the direction of a gauge does."""
    mu = np.linspace(0.02, 1.2, 25)
    grown = tolerance("gauge_angle_deg", 2.0, 0.0)
    grown = type(grown)(grown.name, "degree", 2.0, 1e-3 * mu, 4e-3 * mu)
    return curve(lambda m: 0.1 * np.exp(-((m / 0.55) ** 2)), tolerances=(grown,))


@pytest.mark.parametrize("made", [gauge(), curve(saturating), curve(kinked), curve(turning)])
def test_between_the_ends_of_its_range_every_estimate_is_within_the_limit(made: Calibration) -> None:
    assert made.usable
    for ranges, tolerances in ((made.trusted, True), (made.usable, False)):
        for low, high in ranges:
            for mu in np.linspace(low, high, 7):
                (found,) = estimate(made, float(made["g"].at(mu)), tolerances=tolerances)
                assert found.status == "ok", (mu, found.verdict)
                assert found.std <= made.limit
                assert found.low <= mu <= found.high


def test_outside_its_range_no_estimate_is_within_the_limit() -> None:
    made = gauge()
    ((low, high),) = made.trusted
    step = np.diff(made.judged_mu).max()
    for mu in (*np.arange(0.02, low - step, 0.05), *np.arange(high + step, 1.2, 0.05)):
        assert estimate(made, float(made["g"].at(mu)))[0].status != "ok"


def test_the_range_of_a_straight_curve_ends_where_its_ends_are_plausible() -> None:
    """Within sqrt(2.706) standard deviations of an end, mu may lie beyond it: 1.645 of 0.01 here."""
    ((low, high),) = curve(line(0.015)).trusted
    assert (low, high) == pytest.approx((0.02 + 0.01645, 1.2 - 0.01645), abs=0.013)  # a quarter of the spacing


def test_a_flat_curve_has_no_range() -> None:
    made = curve(lambda mu: 0.03 + 0.0 * mu)
    assert made.trusted == made.usable == ()
    assert made.best is None
    assert "nowhere" in made.verdict()
    assert dict(summary(made))["at mu = 0.61"] == estimate(made, 0.03)[0].verdict


def test_the_table_says_what_an_estimate_says() -> None:
    made = gauge()
    rows = dict(summary(made))
    mu = made.mu[made.best]
    (found,) = estimate(made, made["g"].at(mu))
    assert rows[f"at mu = {mu:.3g}"] == found.verdict
    assert f"+- {found.std:.2g} at best (mu = {mu:.2g}" in made.verdict()
    assert rows["mu within 0.1"].startswith(f"mu = {made.trusted[0][0]:.3g} to {made.trusted[0][1]:.3g}, with all")


@pytest.mark.parametrize("function", [straight, saturating, kinked])
def test_readings_of_a_sensor_within_its_tolerances_are_not_out_of_range(function: Any) -> None:
    """One reading is judged as several are: at p = 0.001, which is 3.29 standard deviations of a single one."""
    made, random = curve(function, tolerances=(tolerance("mesh", 1.0, 3e-4),)), np.random.default_rng(5)
    mu, g = random.uniform(0.02, 1.2, 1000), made["g"]
    readings = g.at(mu) + random.normal(size=1000) * g.reading_sd(mu)
    assert sum(found.status == "outside" for found in estimate(made, readings)) <= 3  # 1 in 1000 at the ends
    end = float(g.at(1.2) - 1.9 * g.reading_sd([1.2])[0])
    assert estimate(made, end)[0].status in ("above", "blind")
    far = float(g.at(1.2) - 3.5 * g.reading_sd([1.2])[0])
    (found,) = estimate(made, far)
    assert found.status == "outside"
    assert "3.5 standard deviations away" in found.verdict
    assert math.isnan(found.low)


def test_the_deviation_fits_the_interval() -> None:
    """A 90 % interval is 3.29 deviations wide if the likelihood is normal, and never less than one."""
    made = gauge()
    for found in made.judged:
        if found.is_determined:
            assert 1.0 < (found.high - found.low) / found.std < 3.6


def test_several_readings_have_a_row_each_and_one_alone_is_judged_as_if_alone() -> None:
    joint = together(curve(line(0.01)), curve(line(-0.006)))
    rows = dict(summary(joint))
    assert rows["  a alone"] == joint.of(["a"]).judged_at_mu[joint.best].verdict
    assert joint.title == "readings a, b together"
    (alone,) = estimate(joint, {"a": 0.055})
    assert alone == estimate(joint.of(["a"]), 0.055)[0]
