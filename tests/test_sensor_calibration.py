"""Curves, files and maps of a calibration, and the model of the sensor."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from finger3d.analyses import pressed_body as pressing
from finger3d.analyses.gauge_places import StrainField
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.sensor import Calibration, Tolerance, estimate, load, save
from finger3d.sensor.calibration import summary
from finger3d.sensor.curve import MonotoneCubic
from tests.commands import run
from tests.sensor_cases import SCENE, curve, kinked, line, saturating, scene, straight, together, tolerance, turning


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


def test_readings_that_share_nothing_add_their_information() -> None:
    joint = together(curve(straight), curve(lambda mu: 0.002 * mu, noise=4e-4))
    expected = 1.0 / math.hypot(0.0015 / 1.5e-4, 0.002 / 4e-4)
    assert joint.mu_sd([0.3, 0.9]) == pytest.approx(expected, rel=1e-6)


def test_one_reading_is_as_if_alone() -> None:
    mu = np.linspace(0.1, 1.0, 7)
    for function in (straight, saturating):
        alone = curve(function, tolerances=(tolerance("depth_mm", 0.1, 0.02), tolerance("mesh", 1.0, 3e-4)))
        g = alone["g"]
        assert alone.mu_sd(mu) == pytest.approx(g.reading_sd(mu) / np.abs(g.slope(mu)), rel=1e-9)


def test_a_shared_tolerance_is_told_apart_from_mu() -> None:
    """Two readings and two unknowns: generalised least squares leaves what the noise leaves."""
    noise, depth = 1e-4, tolerance("depth_mm", 10.0, 0.02)  # far worse known than either reading could tell
    first = curve(line(0.01), noise=noise, tolerances=(depth,))
    second = curve(line(-0.01), noise=noise, tolerances=(depth,))
    assert first.mu_sd([0.5])[0] > 10.0
    # the difference of the two is free of the depth: its slope is 0.02, its noise sqrt(2) times that of one
    assert together(first, second).mu_sd([0.5])[0] == pytest.approx(math.sqrt(2.0) * noise / 0.02, rel=1e-3)
    # readings that the depth changes as mu does tell no more than one
    same = together(first, first)
    assert same.mu_sd([0.5])[0] == pytest.approx(first.mu_sd([0.5])[0], rel=1e-3)


def test_the_covariance_is_that_of_drawn_errors() -> None:
    random = np.random.default_rng(4)
    one = curve(straight, tolerances=(tolerance("depth_mm", 0.1, 0.03), tolerance("gauge_x_mm", 0.3, 0.01)))
    other = curve(saturating, noise=2e-3, tolerances=(tolerance("depth_mm", 0.1, -0.05), tolerance("nu", 0.01, 0.1)))
    joint, draws = together(one, other), 400_000
    depth, place, nu = (sd * random.normal(size=draws) for sd in (0.1, 0.3, 0.01))
    errors = [
        1.5e-4 * random.normal(size=draws) + 0.03 * depth + 0.01 * place,
        2e-3 * random.normal(size=draws) - 0.05 * depth + 0.1 * nu,
    ]
    drawn, found = np.cov(errors), joint.covariance([0.5])[0]
    found[1, 1] -= other["g"].curve_error(0.5) ** 2
    # entries of a covariance of n draws are good to about sqrt(2 / n) of the variances: 0.2 %
    scale = np.sqrt(np.outer(np.diag(drawn), np.diag(drawn)))
    assert (np.abs(found - drawn) / scale).max() < 0.01


def test_knowing_a_cause_reduces_the_variance_by_its_share() -> None:
    alone = curve(straight, tolerances=(tolerance("depth_mm", 0.1, 0.001), tolerance("nu", 0.01, 0.02)))
    shares = alone.reductions([0.5])
    squares = {"noise": 1.5e-4**2, "depth_mm": 1e-4**2, "nu": 2e-4**2}
    for name, square in squares.items():
        assert shares[name][0] == pytest.approx(square / sum(squares.values()), abs=1e-6)


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


def test_a_calibration_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    before = curve(
        saturating,
        tolerances=(Tolerance("nu", "1", 0.003, np.linspace(0.0, 1.0, 25), np.linspace(0.0, 1e-3, 25)),),
        failed=((0.3, "x"),),
    )
    after = load(save(before, tmp_path / "calibration.json"))
    assert np.array_equal(after["g"].reading, before["g"].reading)
    assert np.array_equal(after["g"].tolerances[0].slope, before["g"].tolerances[0].slope)
    assert after.failed == before.failed
    assert estimate(after, 0.005)[0] == estimate(before, 0.005)[0]


def test_calibration_files_that_are_none(tmp_path: Path) -> None:
    good = save(curve(straight), tmp_path / "good.json").read_text()
    data = json.loads(good)
    cases = {
        "not JSON, or cut short": good[: len(good) // 2],
        "version 9, this finger3d reads version 5; calibrate again": json.dumps({**data, "version": 9}),
        "version 2, this finger3d reads version 5; calibrate again": json.dumps({**data, "version": 2}),
        "no calibration": json.dumps([1, 2]),
    }
    for told, text in cases.items():
        path = tmp_path / "bad.json"
        path.write_text(text)
        with pytest.raises(Finger3dError, match=told) as found:
            load(path)
        assert "\n" not in str(found.value)
        assert str(found.value).startswith(str(path))
    with pytest.raises(Finger3dError, match="none.json"):
        load(tmp_path / "none.json")
    with pytest.raises(Finger3dError, match=str(tmp_path)):
        load(tmp_path)


def parts(node: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Places of all parts of a tree."""
    for key in node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ():
        yield (*place, key)
        yield from parts(node[key], (*place, key))


def test_a_file_with_any_part_changed_or_removed_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """Every number is changed by 1e-9 of itself, every word by a letter; every part is removed."""
    one, path = Tolerance("nu", "1", 0.003, np.ones(25), np.ones(25)), tmp_path / "calibration.json"
    text = save(curve(straight, tolerances=(one,), failed=((0.3, "x"),)), path).read_text()
    places = list(parts(json.loads(text)))
    assert len(places) > 200
    for removed in (False, True):
        for place in places:
            data = node = json.loads(text)
            for key in place[:-1]:
                node = node[key]
            value = node.pop(place[-1])
            if not removed and isinstance(value, int | float | str):
                changed = f"{value}x" if isinstance(value, str) else 1.000000001 * value + 1e-12
                node.update({place[-1]: changed}) if isinstance(node, dict) else node.insert(place[-1], changed)
            path.write_text(json.dumps(data))
            with pytest.raises(Finger3dError, match="checksum|no calibration|version"):
                load(path)
    assert run("estimate", path, "--strain", "0.01") == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_a_field_reads_what_a_gauge_there_reads(domain: str) -> None:
    """At (35.5, 39.5) and, in the mirrored half, at (-20.5, 30.5) mm."""
    places, angles = [(35.5, 39.5), (-20.5, 30.5)], (0.0, 40.0, 90.0)
    gauges = [{"name": f"{x}:{a}", "x_mm": x, "y_mm": y, "angle_deg": a} for x, y in places for a in angles]
    size = {"size_mm": 8.0, "base_size_mm": 14.0, "mesher": "swept"} if domain == "solid" else SCENE["mesh"]
    problem = build(scene(gauge=gauges, model={"domain": domain}, mesh=size).model())
    mus = (0.2, 0.4)
    frames = [pressing.press(problem, mu).frame for mu in mus]
    found = StrainField.of_frames(problem, frames, mus).strain(np.insert(places, 2, 0.0, axis=1), np.radians(angles))
    wanted = [[[frame.gauges[f"{x}:{a}"] for frame in frames] for a in angles] for x, _ in places]
    assert found == pytest.approx(np.array(wanted), abs=1e-10)
