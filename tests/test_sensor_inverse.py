"""The friction coefficient from a strain, its standard deviation and its 68 % set."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.sensor import Tolerance, estimate
from tests.sensor_cases import curve, kinked, saturating, straight, turning


def test_a_clean_reading_gives_mu_back_and_the_noise_over_the_slope() -> None:
    found = curve(straight)
    (answer,) = estimate(found, straight(0.5))
    assert answer.status == "ok"
    assert answer.mu == pytest.approx(0.5, abs=1e-9)
    assert answer.std == pytest.approx(0.1, rel=1e-4)  # the calibration ends 4.8 of them away
    assert (answer.low, answer.high) == pytest.approx((0.4, 0.6), rel=1e-6)
    assert "mu = 0.5 +- 0.1" in answer.verdict


def test_readings_are_taken_as_a_vector_with_a_std_each() -> None:
    found = curve(straight)
    answers = estimate(found, straight(np.array([0.3, 0.5])), [1e-5, 1.8e-4])
    assert [round(a.mu, 6) for a in answers] == [0.3, 0.5]
    assert [a.std for a in answers] == pytest.approx([1e-5 / 0.0015, 0.12], rel=2e-3)  # the ends cut 4 sd off
    assert [a.status for a in answers] == ["ok", "coarse"]
    (exact,) = estimate(found, straight(0.7), 0.0)
    assert exact.low <= exact.mu <= exact.high
    assert exact.high - exact.low < 1e-6


def test_beyond_the_last_mu_that_can_be_told_apart() -> None:
    """exp(-4 mu): at a reading of the value at 1.0 all mu with strain within one noise of it, up to the end, remain."""
    found = curve(saturating)
    (answer,) = estimate(found, saturating(1.0))
    edge = -math.log((saturating(1.0) + 1.5e-4) / 0.01) / 4.0
    assert answer.status == "above"
    assert answer.low == pytest.approx(edge, abs=2e-3)
    assert f"mu > {answer.low:.3g}" in answer.verdict
    assert math.isnan(answer.mu)
    assert math.isinf(answer.high)
    (low,) = estimate(curve(lambda mu: saturating(1.22 - mu)), saturating(1.0))
    assert low.status == "below"
    assert "mu < 0.3" in low.verdict


def test_near_the_end_of_the_calibration_the_end_is_to_blame() -> None:
    (answer,) = estimate(curve(straight), straight(1.15))
    assert "mu > 1.05" in answer.verdict
    assert "1.2" in answer.verdict


def test_a_strain_that_no_mu_has() -> None:
    (answer,) = estimate(curve(straight), 0.12)
    assert answer.status == "outside"
    assert "0.02 to 1.2 " in answer.verdict
    assert "at mu = 0.02" in answer.verdict
    assert math.isnan(answer.low)


def test_two_answers_are_both_named() -> None:
    (answer,) = estimate(curve(turning), turning(0.3), 1e-5)
    assert answer.status == "ambiguous"
    assert [round(c.mu, 3) for c in answer.candidates] == [0.3, 0.9]
    assert "mu = 0.3 +-" in answer.verdict
    assert "mu = 0.9 +-" in answer.verdict


def test_at_the_turn_the_two_answers_are_one_wide_one() -> None:
    (answer,) = estimate(curve(turning), turning(0.6), 1.0e-4)
    assert answer.low == pytest.approx(0.5, abs=0.01)  # 0.01 (mu - 0.6)^2 = 1e-4
    assert answer.high == pytest.approx(0.7, abs=0.01)
    assert len(answer.candidates) == 1


@pytest.mark.parametrize("function", [straight, turning, saturating])
def test_the_68_percent_set_covers_the_truth_68_percent_of_the_time(function: Any) -> None:
    """Inverting |strain - curve| <= sd covers P(|N| <= 1) of the time, on curves that turn or saturate as well."""
    found = curve(function)
    assert found.interpolation_error < 0.1 * found.noise  # or the set would be wider than the noise asks
    random = np.random.default_rng(20261121)
    count = 4000
    mu = random.uniform(0.02, 1.2, count)
    answers = estimate(found, found.at(mu) + random.normal(0.0, found.noise, count))
    hit = sum(any(c.low <= m <= c.high for c in a.candidates) for m, a in zip(mu, answers, strict=True))
    wanted = math.erf(1.0 / math.sqrt(2.0))
    # binomial: three standard deviations, and what the interpolation error adds to the width
    assert abs(hit / count - wanted) <= 3.0 * math.sqrt(wanted * (1.0 - wanted) / count) + 0.003


@pytest.mark.parametrize("function", [straight, saturating, kinked])
def test_the_standard_deviation_is_that_of_the_errors(function: Any) -> None:
    """Of mu with noise that grows and of readings that stray from a flat part to a steep one as well.

    For mu drawn evenly over the calibrated range the mean square of (told - true) / std is 1 for every reading, being
    that of the likelihood; with the slope where the curve has the reading, `kinked` gives a root mean square of 4.5.
    """
    grown = Tolerance("mesh", "error bar", 1.0, np.zeros(25), 3e-4 * np.linspace(0.0, 1.0, 25))
    found = curve(function, tolerances=(grown,))
    random = np.random.default_rng(20261122)
    mu = random.uniform(0.02, 1.2, 2000)
    answers = estimate(found, found.at(mu) + random.normal(0.0, 1.0, len(mu)) * found.reading_sd(mu))
    told = [i for i, a in enumerate(answers) if a.status in ("ok", "coarse")]
    z = np.array([(answers[i].mu - mu[i]) / answers[i].std for i in told])
    assert len(told) > 1000
    # of 1000 values z^2 with a kurtosis of 10 the mean has a standard deviation of 0.1, its root half of that
    assert abs(math.sqrt(np.mean(z**2)) - 1.0) < 0.1
    assert np.mean(np.abs(z) > 3.0) < 0.02
    assert 0.65 < np.mean(np.abs(z) <= 1.0) < 0.8
    hit = np.mean([any(c.low <= m <= c.high for c in a.candidates) for m, a in zip(mu, answers, strict=True)])
    wanted = math.erf(1.0 / math.sqrt(2.0))
    assert abs(hit - wanted) <= 3.0 * math.sqrt(wanted * (1.0 - wanted) / len(mu)) + 0.003


@pytest.mark.parametrize(
    ("strain", "std", "told"),
    [
        (math.nan, None, "strain = nan: "),
        ([0.01, math.inf], None, "reading 2 of 2"),
        (0.01, -1e-4, "std = -0.0001: "),
        (0.01, math.nan, "std = nan"),
        ([0.01, 0.02, 0.03], [1e-4, 1e-4], "2 .* 3 "),
    ],
)
def test_readings_that_are_none(strain: Any, std: Any, told: str) -> None:
    with pytest.raises(Finger3dError, match=told.replace("(", r"\(")):
        estimate(curve(straight), strain, std)


def test_tolerances_widen_and_are_blamed() -> None:
    tilt = Tolerance("tilt_deg", "degree", 0.5, np.full(25, 0.02), np.full(25, 0.01))
    found = curve(straight, tolerances=(tilt,))
    (blind,) = estimate(found, straight(0.5))
    assert blind.status == "blind"
    assert re.search(r"100 % .*tilt_deg$", blind.verdict)
    assert "+- 6.7" in found.verdict()  # 0.01 of strain over a slope of 0.0015
    (clear,) = estimate(found, straight(0.5), tolerances=False)
    assert clear.std == pytest.approx(0.1, rel=1e-4)
