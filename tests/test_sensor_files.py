"""Calibrations as files and commands: what is written, read, refused, and kept when something fails."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calibrate import presses as pressing
from finger3d.analyses.calibrate import run as runs
from finger3d.analyses.calibrate.run import calibrate
from finger3d.analyses.calibrate.settings import parsed_mus
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.analyses.reduced import ReducedModel
from finger3d.cli import main
from finger3d.errors import Finger3dError, MissingError, Outcome
from finger3d.io import claimed
from finger3d.scene import load as load_scene
from finger3d.sensor import Tolerance, estimate, load, save
from tests.sensor_cases import FEW, NONE, curve, saturating, scene, straight


def run(*arguments: object) -> int:
    return main([str(a) for a in arguments])


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml(), encoding="utf-8")
    return path


def test_points_that_fail_are_kept_as_failures(tmp_path: Path, monkeypatch: Any, scene_file: Path, capsys: Any) -> None:
    whole = pressing.press

    def some(problem: Any, mu: float, *rest: Any) -> Any:
        found = whole(problem, mu, *rest)
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
    monkeypatch.setattr(pressing, "press", lambda p, mu, *rest: replace(some(p, 0.4), mu=mu))
    with pytest.raises(MissingError, match="only 0 of 6"):
        calibrate(scene(), "g36", out, FEW, tolerances=NONE)
    assert "did not settle" in (out / "calibration.csv").read_text()


def test_an_interruption_keeps_the_points_so_far(
    tmp_path: Path, monkeypatch: Any, scene_file: Path, capsys: Any
) -> None:
    whole = pressing.press

    def until(problem: Any, mu: float, *rest: Any) -> Any:
        if mu > 0.5:
            raise KeyboardInterrupt
        return whole(problem, mu, *rest)

    monkeypatch.setattr(pressing, "press", until)
    out = tmp_path / "cal"
    assert run("calibrate", scene_file, "--gauge", "g36", "--out", out, "--mu", ",".join(map(str, FEW))) == 130
    assert "3 of 6 values of mu are kept" in capsys.readouterr().err
    assert len((out / "calibration.csv").read_text().splitlines()) == 4
    assert not (out / "calibration.json").exists()


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
    assert (data["format"], data["version"], len(data["hash"])) == ("finger3d calibration", 2, 16)
    assert data["about"]["factorizations"] == 1
    assert ReducedModel.load(out / "reduced.npz").gauges == ("g36", "long")
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
    assert "1 of 2 readings determine mu" in capsys.readouterr().out
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
    assert np.array_equal(after.reading, before.reading)
    assert np.array_equal(after.tolerances[0].slope, before.tolerances[0].slope)
    assert after.failed == before.failed
    assert estimate(after, 0.005)[0] == estimate(before, 0.005)[0]


def test_calibration_files_that_are_none(tmp_path: Path) -> None:
    good = save(curve(straight), tmp_path / "good.json").read_text()
    data = json.loads(good)
    short = {**data, "curve": {"mu": data["curve"]["mu"][:5], "strain": data["curve"]["strain"]}}
    cases = {
        "not JSON, or cut short": good[: len(good) // 2],
        "version 9, this finger3d reads version 2": json.dumps({**data, "version": 9}),
        "version 1, this finger3d reads version 2": json.dumps({**data, "version": 1}),
        "no calibration": json.dumps([1, 2]),
        "curve: missing": json.dumps({k: v for k, v in data.items() if k != "curve"}),
        "noise = 0.0: must be a number from 1e-12 to 1000": json.dumps({**data, "noise": 0.0}),
        "curve: must have a reading and tolerances for each of the 5": json.dumps(short),
        "gauge: must be a text": json.dumps({**data, "gauge": 3}),
        "curve: must be a table": json.dumps({**data, "curve": [1.0]}),
        "resolution_limit = True: must be a number": json.dumps({**data, "resolution_limit": True}),
        "failed.mu: missing": json.dumps({**data, "failed": ["x"]}),
        "curve.strain.0 = nan: must be": json.dumps(data | {"curve": data["curve"] | {"strain": [float("nan")] * 25}}),
        "curve.mu.0 = 'a': must be a number from 0": json.dumps(
            {**data, "curve": {**data["curve"], "mu": ["a", 1.0, 2.0, 3.0]}}
        ),
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
        (["--gauge", "g36", "--noise", "0"], "--noise 0: must be a finite number from 1e-12 to 1000"),
        (["--gauge", "g36", "--noise", "1e300"], "--noise 1e+300: must be a finite number from 1e-12 to 1000"),
        (["--gauge", "g36", "--mu", "0.1,0.2,0.3,1e300"], "--mu: 1e+300"),
        (["--gauge", "g36", "--tolerance", "depth_mm=1e300"], "from 0 up to 1e+06"),
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


@pytest.mark.parametrize(
    ("place", "value"),
    [(("noise",), 1e300), (("resolution_limit",), 1e300), (("curve", "strain", 3), -1e300),
     (("curve", "mu", 24), 1e300), (("tolerances", "nu", "sd"), 1e300),
     (("tolerances", "nu", "strain_per_unit", 2), 1e300), (("tolerances", "nu", "strain_sd", 2), 1e300)],
)  # fmt: skip
def test_a_number_that_would_overflow_is_refused(
    place: tuple[Any, ...], value: float, tmp_path: Path, capsys: Any
) -> None:
    one = Tolerance("nu", "1", 0.003, np.ones(25), np.ones(25))
    data = json.loads(save(curve(straight, tolerances=(one,)), tmp_path / "calibration.json").read_text())
    node = data
    for key in place[:-1]:
        node = node[key]
    node[place[-1]] = value
    (tmp_path / "calibration.json").write_text(json.dumps(data))
    assert run("estimate", tmp_path / "calibration.json", "--strain", "0.01") == 2
    err = capsys.readouterr().err
    assert ".".join(map(str, place)) in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("options", [["--strain", "1e300"], ["--strain", "0.01", "--std", "1e300"]])
def test_a_reading_that_would_overflow_is_refused(options: list[str], tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    assert run("estimate", kept, *options) == 2
    assert "1e+300: must be" in capsys.readouterr().err


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


def test_the_help_names_every_tolerance(capsys: Any) -> None:
    assert run("calibrate", "--help") == 0
    assert set(TOLERANCES) <= set(re.findall(r"\w+", capsys.readouterr().out))


def test_values_of_mu_are_spread_evenly() -> None:
    assert parsed_mus("0.02:1.2:25")[0::24] == (0.02, 1.2)
    assert len(parsed_mus("0.02:1.2:25")) == 25
    assert parsed_mus("0.1, 0.5") == (0.1, 0.5)


def test_the_scene_kept_beside_a_calibration_is_the_scene(tmp_path: Path) -> None:
    calibrate(scene(), "g36", tmp_path, FEW[:4], tolerances=NONE)
    assert load_scene(tmp_path / "scene.toml") == scene()
