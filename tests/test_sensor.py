"""Calibration and estimation: curves, tolerances, honest intervals, files and commands."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.errors import Finger3dError, MissingError, Outcome
from finger3d.export import claimed
from finger3d.reduced import Condensed
from finger3d.scene import load as load_scene
from finger3d.sensor import TOLERANCES, Calibration, Tolerance, calibrate, estimate, load, save
from finger3d.sensor import presses as pressing
from finger3d.sensor import run as runs
from finger3d.sensor.maps import Reader, StrainMap
from finger3d.sensor.run import calibrated, parsed_mus
from finger3d.solve import build
from tests.sensor_cases import FEW, NONE, SCENE, scene


def run(*arguments: object) -> int:
    return main([str(a) for a in arguments])


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml(), encoding="utf-8")
    return path


def curve(function: Any, **changes: Any) -> Calibration:
    mu = np.linspace(0.02, 1.2, 25)
    return Calibration("g", mu, function(mu), **{"noise": 1.5e-4, "limit": 0.1, **changes})


def straight(mu: Any) -> Any:
    return 0.09 - 0.0015 * mu


def saturating(mu: Any) -> Any:
    return 0.01 * np.exp(-4.0 * mu)


def turning(mu: Any) -> Any:
    return 0.01 * (mu - 0.6) ** 2


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
    assert answer.std == pytest.approx(0.1, rel=1e-6)
    assert (answer.low, answer.high) == pytest.approx((0.4, 0.6), rel=1e-6)
    assert "mu = 0.5 +- 0.1" in answer.verdict


def test_readings_are_taken_as_a_vector_with_a_std_each() -> None:
    found = curve(straight)
    answers = estimate(found, straight(np.array([0.3, 0.5])), [1e-5, 3e-4])
    assert [round(a.mu, 6) for a in answers] == [0.3, 0.5]
    assert [a.std for a in answers] == pytest.approx([1e-5 / 0.0015, 0.2], rel=1e-6)
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


def test_coverage_with_a_depth_that_is_off_by_presses_of_the_real_body() -> None:
    """Depth errors are pressed, not linearised; noise is drawn; the interval comes from the calibration's slopes."""
    model = scene().model()
    found, problem, _ = calibrated(model, "g36", np.linspace(0.1, 1.0, 13), tolerances={**NONE, "depth_mm": 0.1})
    body = Condensed.of(problem)
    random = np.random.default_rng(7)
    count = 250
    hits = 0
    for mu in random.uniform(0.2, 0.9, count):
        legs = [replace(leg, depth_mm=leg.depth_mm + random.normal(0.0, 0.1)) for leg in model.legs]
        strain = body.press(float(mu), legs).frames[-1].gauges["g36"] + random.normal(0.0, found.noise)
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
        (0.01, -1e-4, "std = -0.0001: must be a finite number from 0 up"),
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
    assert clear.std == pytest.approx(0.1, rel=1e-6)


def test_points_that_fail_are_kept_as_failures(tmp_path: Path, monkeypatch: Any, scene_file: Path, capsys: Any) -> None:
    whole = pressing.press

    def some(problem: Any, mu: float, near: Any = ()) -> Any:
        found = whole(problem, mu, near)
        failed = replace(found.frame, outcome=Outcome.NO_CONVERGENCE)
        return replace(found, frame=failed) if mu in (0.4, 0.9) else found

    monkeypatch.setattr(pressing, "press", some)
    out = tmp_path / "cal"
    assert run("calibrate", scene_file, "--gauge", "g36", "--out", out, "--mu", ",".join(map(str, FEW)),
               "--tolerance", "nu=0", "--tolerance", "tilt_deg=0") == 3  # fmt: skip
    said = capsys.readouterr().err
    assert "2 of 6 values of mu gave no strain, the first mu = 0.4" in said
    found = load(out / "calibration.json")
    assert [mu for mu, _ in found.failed] == [0.4, 0.9]
    assert len(found.mu) == 4
    with (out / "calibration.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert sum("did not settle" in row["outcome"] for row in rows) == 2
    monkeypatch.setattr(pressing, "press", lambda p, mu, near: replace(some(p, 0.4), mu=mu))
    with pytest.raises(MissingError, match="only 0 of 6"):
        calibrate(scene(), "g36", out, FEW, tolerances=NONE)
    assert "did not settle" in (out / "calibration.csv").read_text()


def test_an_interruption_keeps_the_points_so_far(
    tmp_path: Path, monkeypatch: Any, scene_file: Path, capsys: Any
) -> None:
    whole = pressing.press

    def until(problem: Any, mu: float, near: Any) -> Any:
        if mu > 0.5:
            raise KeyboardInterrupt
        return whole(problem, mu, near)

    monkeypatch.setattr(pressing, "press", until)
    out = tmp_path / "cal"
    assert run("calibrate", scene_file, "--gauge", "g36", "--out", out, "--mu", ",".join(map(str, FEW))) == 130
    assert "3 of 6 values of mu are kept" in capsys.readouterr().err
    assert len((out / "calibration.csv").read_text().splitlines()) == 4
    assert not (out / "calibration.json").exists()


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


# --- files and commands ----------------------------------------------------------------------------------------------


def test_from_a_scene_to_mu_with_two_commands(tmp_path: Path, scene_file: Path, capsys: Any) -> None:
    out = tmp_path / "cal"
    sure = "tilt_deg=0.01 gauge_angle_deg=0.1 gauge_x_mm=0.01 gauge_y_mm=0.01 depth_mm=0.01 nu=1e-4 mesh=0.01".split()
    options = [word for text in sure for word in ("--tolerance", text)]
    assert run("calibrate", scene_file, "--gauge", "g36", "--out", out, "--mu", "0:0.8:9", "--map", *options) == 0
    told = capsys.readouterr().out
    for text in ("usable", "resolution at mu", "second-order fit", "tilt_deg", "gauge g36: usable from mu"):
        assert text in told
    names = {p.name for p in out.iterdir() if p.name != ".finger3d.lock"}
    assert names == {"calibration.json", "calibration.csv", "calibration.png", "reduced.npz", "report.html",
                     "scene.toml", "map.png", "map.csv"}  # fmt: skip
    data = json.loads((out / "calibration.json").read_text())
    assert (data["format"], data["version"], len(data["hash"])) == ("finger3d calibration", 1, 16)
    assert data["about"]["factorizations"] == 1
    assert Condensed.load(out / "reduced.npz").gauges == ("g36", "long")
    found = load(out / "calibration.json")
    strain = float(found.at(0.4))
    assert run("estimate", out / "calibration.json", "--strain", repr(strain)) == 0
    assert capsys.readouterr().out.startswith("mu = 0.4 +- ")
    assert run("estimate", out / "calibration.json", "--strain", repr(strain), "--std", "1e-3", "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["mu"] == pytest.approx(0.4, abs=1e-6)
    assert answer["std"] > 0.0


def test_many_readings_from_a_csv(tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    readings = tmp_path / "readings.csv"
    readings.write_text(f"time,strain,std\n0,{straight(0.3)!r},1e-5\n1,0.2,1e-5\n")
    assert run("estimate", kept, "--csv", readings) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    assert float(rows[0]["mu"]) == pytest.approx(0.3)
    assert rows[1]["status"] == "outside"
    assert run("estimate", kept, "--csv", readings, "--out", tmp_path / "mu.csv") == 0
    assert "1 of 2 readings tell mu" in capsys.readouterr().out
    assert len((tmp_path / "mu.csv").read_text().splitlines()) == 3
    assert run("estimate", kept, "--csv", readings, "--json", "--curve", "fit") == 0
    assert [a["status"] for a in json.loads(capsys.readouterr().out)] == ["ok", "outside"]


def test_a_calibration_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    before = curve(
        saturating,
        tolerances=(Tolerance("nu", "1", 0.003, np.linspace(0.0, 1.0, 25), np.linspace(0.0, 1e-3, 25)),),
        failed=((0.3, "x"),),
    )
    after = load(save(before, tmp_path / "calibration.json"))
    assert np.array_equal(after.strain, before.strain)
    assert np.array_equal(after.tolerances[0].slope, before.tolerances[0].slope)
    assert after.failed == before.failed
    assert estimate(after, 0.005)[0] == estimate(before, 0.005)[0]


def test_calibration_files_that_are_none(tmp_path: Path) -> None:
    good = save(curve(straight), tmp_path / "good.json").read_text()
    data = json.loads(good)
    short = {**data, "curve": {"mu": data["curve"]["mu"][:5], "strain": data["curve"]["strain"]}}
    cases = {
        "not JSON, or cut short": good[: len(good) // 2],
        "version 9, this finger3d reads version 1": json.dumps({**data, "version": 9}),
        "no calibration": json.dumps([1, 2]),
        "curve: field required": json.dumps({k: v for k, v in data.items() if k != "curve"}),
        "noise: input should be greater than 0": json.dumps({**data, "noise": 0.0}),
        "curve: mu must ascend": json.dumps(short),
        "curve.mu.0: input should be": json.dumps({**data, "curve": {**data["curve"], "mu": ["a", 1.0, 2.0, 3.0]}}),
    }
    for told, text in cases.items():
        path = tmp_path / "bad.json"
        path.write_text(text)
        with pytest.raises(Finger3dError, match=told) as found:
            load(path)
        assert "\n" not in str(found.value)
        assert str(found.value).startswith(str(path))
    with pytest.raises(Finger3dError, match="no such file"):
        load(tmp_path / "none.json")
    with pytest.raises(Finger3dError, match="cannot be read"):
        load(tmp_path)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--gauge", "g63"], '--gauge g63: no such gauge; did you mean "g36"?'),
        (["--gauge", "g36", "--mu", "0.1,-0.2,0.3,0.4"], "--mu: -0.2: must be finite numbers from 0 up"),
        (["--gauge", "g36", "--mu", "0.1,nan,0.3,0.4"], "--mu: nan"),
        (["--gauge", "g36", "--mu", "0,0,0,0"], "1 different value; a calibration needs at least 4"),
        (["--gauge", "g36", "--mu", "a:b"], "must be first:last:count"),
        (["--gauge", "g36", "--mu", "0:1:100000000"], "must be first:last:count"),
        (["--gauge", "g36", "--noise", "0"], "--noise 0: must be a finite number above 0"),
        (["--gauge", "g36", "--resolution", "nan"], "--resolution nan"),
        (["--gauge", "g36", "--tolerance", "deep_mm=1"], 'did you mean "depth_mm"?'),
        (["--gauge", "g36", "--tolerance", "depth_mm"], "must be NAME=NUMBER"),
        (["--gauge", "g36", "--tolerance", "nu=-1"], "from 0 up"),
        (["--gauge", "g36", "--set", "gauge=[]"], "the scene has no [[gauge]]"),
    ],
)
def test_mistakes_are_one_line_before_any_work(
    options: list[str], told: str, tmp_path: Path, scene_file: Path, capsys: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr(runs, "build", lambda *a: pytest.fail("work was done"))
    assert run("calibrate", scene_file, "--out", tmp_path / "cal", *options) == 2
    err = capsys.readouterr().err
    assert told in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize(
    ("text", "options", "told"),
    [
        ("strain\n0.01\nabc\n", [], "line 3: strain = 'abc': must be a number"),
        ("strain\n0.01\nnan\n", [], "strain = nan (reading 2 of 2)"),
        ("x\n1\n", [], "must have a column named strain"),
        ("", [], "at least one reading"),
        ("strain,std\n0.01,-1\n", [], "std = -1.0: must be"),
        ("strain\n0.01\n", ["--strain", "0.1"], "give either"),
    ],
)
def test_mistakes_in_readings(text: str, options: list[str], told: str, tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    (tmp_path / "readings.csv").write_text(text)
    assert run("estimate", kept, "--csv", tmp_path / "readings.csv", *options) == 2
    err = capsys.readouterr().err
    assert told in err
    assert len(err.splitlines()) == 1


def test_estimate_of_nan_and_of_nothing(tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    assert run("estimate", kept, "--strain", "nan") == 2
    assert "strain = nan: must be a finite number" in capsys.readouterr().err
    assert run("estimate", kept) == 2
    assert run("estimate", kept, "--strain", "0.1", "--out", tmp_path / "x.csv") == 2


def test_calibrate_prints_json_alone(tmp_path: Path, scene_file: Path, capsys: Any) -> None:
    none = [word for name in TOLERANCES for word in ("--tolerance", f"{name}=0")]
    options = ["--gauge", "g36", "--out", tmp_path / "cal", "--mu", ",".join(map(str, FEW)), "--json", *none]
    assert run("calibrate", scene_file, *options) == 0
    assert json.loads(capsys.readouterr().out)["curve"]["mu"] == list(FEW)


def test_a_folder_takes_one_calibration_at_a_time(tmp_path: Path) -> None:
    with claimed(tmp_path), pytest.raises(Finger3dError, match="another finger3d is writing there"):
        calibrate(scene(), "g36", tmp_path)


def test_values_of_mu_are_spread_evenly() -> None:
    assert parsed_mus("0.02:1.2:25")[0::24] == (0.02, 1.2)
    assert len(parsed_mus("0.02:1.2:25")) == 25
    assert parsed_mus("0.1, 0.5") == (0.1, 0.5)


def test_the_scene_kept_beside_a_calibration_is_the_scene(tmp_path: Path) -> None:
    calibrate(scene(), "g36", tmp_path, FEW[:4], tolerances=NONE)
    assert load_scene(tmp_path / "scene.toml") == scene()
