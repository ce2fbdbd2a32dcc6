"""Calibration and estimation: curves, tolerances, honest intervals, maps."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calibrate import presses as pressing
from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.reduced import ReducedModel
from finger3d.errors import Finger3dError
from finger3d.mechanics.build import build
from finger3d.sensor import Calibration, Tolerance, estimate
from finger3d.sensor.maps import Reader, StrainMap
from tests.sensor_cases import NONE, SCENE, curve, kinked, saturating, scene, straight, turning

# --- the curve -------------------------------------------------------------------------------------------------------


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
    assert "same strains occur" in found.verdict()


def test_the_range_with_all_tolerances_is_where_their_error_leaves_mu_within_the_limit() -> None:
    mu = np.linspace(0.0, 1.0, 21)
    # strain falls by .1 a unit of mu; a tolerance of .02 in strain at mu = 0, none at 1: within .1 from mu = .5 on
    tolerance = Tolerance("depth_mm", "mm", 1.0, np.zeros(21), 0.02 * (1.0 - mu))
    found = Calibration("g", mu, 0.2 - 0.1 * mu, 1e-6, 0.1, (tolerance,))
    (stretch,) = found.trusted
    assert (stretch.low, stretch.high) == pytest.approx((0.5, 1.0), abs=0.01)
    assert (found.usable[0].low, found.usable[0].high) == (0.0, 1.0)
    assert "0.1 or better from mu = 0.5 to 1" in found.verdict()


def test_a_flat_curve_has_no_usable_range() -> None:
    found = curve(lambda mu: 0.03 + 0.0 * mu)
    assert found.usable == ()
    assert "no usable range" in found.verdict()
    assert estimate(found, 0.03)[0].status == "blind"
    assert "no mu from 0.02 to 1.2 can be told apart" in estimate(found, 0.03)[0].verdict


def test_shares_sum_to_one() -> None:
    found = curve(straight, tolerances=(Tolerance("depth_mm", "mm", 0.1, np.full(25, 1e-3), np.full(25, 1e-4)),))
    shares = found.shares(0.5)
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares["depth_mm"] == pytest.approx(1e-8 / (1e-8 + 2.25e-8), rel=1e-6)


# --- the inverse -----------------------------------------------------------------------------------------------------


def test_two_answers_of_a_monotone_curve_are_blamed_on_what_is_not_known() -> None:
    error = 0.06 * np.linspace(0.02, 1.2, 25) ** 4
    wide = Tolerance("mesh", "error bar", 1.0, error, error)
    found = curve(lambda mu: 0.1 * np.exp(-2.0 * mu), tolerances=(wide,))
    (answer,) = estimate(found, 0.05)
    assert answer.status == "ambiguous"
    assert answer.verdict.endswith("; what is not known exactly reaches that far")


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
    assert answer.verdict == f"out of range: the strain at mu > {answer.low:.3g} cannot be told apart"
    assert math.isnan(answer.mu)
    assert math.isinf(answer.high)
    (low,) = estimate(curve(lambda mu: saturating(1.22 - mu)), saturating(1.0))
    assert low.status == "below"
    assert "mu < 0.3" in low.verdict


def test_near_the_end_of_the_calibration_the_end_is_to_blame() -> None:
    (answer,) = estimate(curve(straight), straight(1.15))
    assert answer.verdict == "out of range: mu > 1.05, and the calibration ends at 1.2"


def test_a_strain_that_no_mu_has() -> None:
    (answer,) = estimate(curve(straight), 0.12)
    assert answer.status == "outside"
    assert "no mu from 0.02 to 1.2 has this strain" in answer.verdict
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
    answers = estimate(found, found.at(mu) + random.normal(0.0, 1.0, len(mu)) * found.strain_sd(mu))
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


def test_coverage_with_a_depth_that_is_off_by_presses_of_the_real_body() -> None:
    """Depth errors are pressed, not linearised; noise is drawn; the interval comes from the calibration's slopes."""
    model = scene().model()
    found, curve = calibrated(model, "g36", np.linspace(0.1, 1.0, 13), tolerances={**NONE, "depth_mm": 0.1})
    body = ReducedModel.of(curve.problem)
    random = np.random.default_rng(7)
    count = 250
    hits = 0
    for mu in random.uniform(0.2, 0.9, count):
        legs = [replace(leg, depth_mm=leg.depth_mm + random.normal(0.0, 0.1)) for leg in model.legs]
        strain = body.press(float(mu), legs).steps[-1].gauges["g36"] + random.normal(0.0, found.noise)
        (answer,) = estimate(found, strain)
        hits += any(c.low <= mu <= c.high for c in answer.candidates)
    wanted = math.erf(1.0 / math.sqrt(2.0))
    # three binomial standard deviations; the interpolation error, which is no random one here, can only widen the set
    three = 3.0 * math.sqrt(wanted * (1.0 - wanted) / count)
    assert wanted - three <= hits / count <= wanted + three + 0.1


@pytest.mark.parametrize(
    ("strain", "std", "told"),
    [
        (math.nan, None, "strain = nan: must be a finite number"),
        ([0.01, math.inf], None, "reading 2 of 2"),
        (0.01, -1e-4, "std = -0.0001: must be a finite number from 0 to 1000"),
        (0.01, math.nan, "std = nan"),
        ([0.01, 0.02, 0.03], [1e-4, 1e-4], "2 of them for 3 strains"),
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
    assert blind.verdict.endswith("; 100 % of the variance is from tilt_deg")
    assert "to +- 6.7 at best" in found.verdict()  # 0.01 of strain over a slope of 0.0015
    (clear,) = estimate(found, straight(0.5), tolerances=False)
    assert clear.std == pytest.approx(0.1, rel=1e-4)


# --- maps ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_the_map_reads_what_a_gauge_there_reads(domain: str) -> None:
    """The middles of squares at (35.5, 39.5) and, in the mirrored half, (-20.5, 30.5) mm."""
    places = [(35.5, 39.5), (-20.5, 30.5)]
    gauges = [{"name": f"{x}:{a}", "x_mm": x, "y_mm": y, "angle_deg": a} for x, y in places for a in (0.0, 40.0, 90.0)]
    size = {"size_mm": 8.0, "base_size_mm": 14.0, "mesher": "swept"} if domain == "solid" else SCENE["mesh"]
    model = scene(gauge=gauges, model={"domain": domain}, mesh=size).model()
    problem = build(model)
    frames = {mu: pressing.press(problem, mu).frame for mu in (0.2, 0.4)}
    found = StrainMap.of(problem, frames)
    for x, y in places:
        i, j = int(np.argmin(np.abs(found.y - y))), int(np.argmin(np.abs(found.x - x)))
        for a in (0.0, 40.0, 90.0):
            got = found.along(math.radians(a))[:, i, j]
            assert got == pytest.approx([frames[mu].gauges[f"{x}:{a}"] for mu in (0.2, 0.4)], abs=1e-10)
    slope = found.slope_at(0.0, 0.3)
    assert slope.shape == (len(found.y), len(found.x))
    assert np.isnan(slope[-1, 0])  # beside the dome
    assert np.isfinite(slope[0]).all()


def test_the_map_of_a_mirror_image_is_a_mirror_image() -> None:
    problem = build(scene().model())
    found = StrainMap.of(problem, {mu: pressing.press(problem, mu).frame for mu in (0.2, 0.6)})
    assert np.allclose(found.along(0.5), found.along(math.pi - 0.5)[:, :, ::-1], atol=1e-12, equal_nan=True)
    best, angle = found.best()
    assert np.nanmax(found.worst_slope(0.5) - best) <= np.nanmax(best) * 0.05  # the best of 5 degree steps
    assert np.nanmin(angle) >= 0.0


def test_a_reader_of_a_linear_field_is_exact() -> None:
    problem = build(scene().model())
    u = problem.mesh.points @ np.array([[0.1, 0.3], [-0.2, 0.05]])
    read = Reader.at(problem.mesh, np.array([[10.0, 20.0], [0.0, 200.0]]), ()).strain(u)
    assert read[0] == pytest.approx([0.1, 0.05, 0.05], abs=1e-12)
    assert np.isnan(read[1]).all()
