"""Command ``calibrate``: files, JSON, refusals, and what is kept when something fails."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from finger3d.analyses import pressed_body as pressing
from finger3d.analyses.calibrate import run as runs
from finger3d.analyses.calibrate.run import calibrate
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.analyses.reduced import ReducedModel
from finger3d.errors import MissingError, Outcome
from finger3d.sensor import load
from tests.commands import run
from tests.sensor_cases import FEW, NONE, scene


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
    assert "2 of 6" in said
    found = load(out / "calibration.json")
    assert [mu for mu, _ in found.failed] == [0.4, 0.9]
    assert len(found.mu) == 4
    with (out / "calibration.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert sum(row["outcome"].endswith(str(Outcome.NO_CONVERGENCE)) for row in rows) == 2
    monkeypatch.setattr(pressing, "press", lambda p, mu, *rest: replace(some(p, 0.4), mu=mu))
    with pytest.raises(MissingError, match=r"\b0 of 6\b"):
        calibrate(scene(), "g36", out, FEW, tolerances=NONE)
    assert str(Outcome.NO_CONVERGENCE) in (out / "calibration.csv").read_text()


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
    assert "3 of 6" in capsys.readouterr().err
    assert len((out / "calibration.csv").read_text().splitlines()) == 4
    assert not (out / "calibration.json").exists()


def test_from_a_scene_to_mu_with_two_commands(tmp_path: Path, scene_file: Path, capsys: Any) -> None:
    out = tmp_path / "cal"
    sure = "tilt_deg=0.01 gauge_angle_deg=0.1 gauge_x_mm=0.01 gauge_y_mm=0.01 depth_mm=0.01 nu=1e-4 mesh=0.01".split()
    options = [word for text in sure for word in ("--tolerance", text)]
    assert run("calibrate", scene_file, "--gauge", "g36", "--out", out, "--mu", "0:0.8:9", "--map", *options) == 0
    told = capsys.readouterr().out
    for text in (
        "mu within 0.1",
        "by the noise alone",
        "second-order fit",
        "tilt_deg",
        "gauge g36: mu is found to 0.1 or better",
    ):
        assert text in told
    names = {p.name for p in out.iterdir() if p.name != ".finger3d.lock"}
    assert names == {"calibration.json", "calibration.csv", "calibration.png", "reduced.npz", "report.html",
                     "scene.toml", "map.png", "map.csv"}  # fmt: skip
    data = json.loads((out / "calibration.json").read_text())
    assert (data["format"], data["version"], len(data["hash"])) == ("finger3d calibration", 5, 16)
    assert data["about"]["factorizations"] == 1
    assert ReducedModel.load(out / "reduced.npz").gauges == ("g36", "long")
    found = load(out / "calibration.json")
    mu = float(found.mu[found.best])
    strain = float(found["g36"].at(mu))
    assert run("estimate", out / "calibration.json", "--strain", repr(strain)) == 0
    assert float(capsys.readouterr().out.split()[2]) == pytest.approx(mu, abs=0.01)
    assert run("estimate", out / "calibration.json", "--strain", repr(strain), "--std", "5e-4", "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["stds"] == {"g36": 5e-4}
    assert answer["std"] > found.judged_at_mu[found.best].std


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--gauge", "g63"], "--gauge g63"),
        (["--gauge", "g36", "--mu", "0.1,-0.2,0.3,0.4"], "--mu: -0.2"),
        (["--gauge", "g36", "--mu", "0.1,nan,0.3,0.4"], "--mu: nan"),
        (["--gauge", "g36", "--mu", "0,0,0,0"], "1 different"),
        (["--gauge", "g36", "--mu", "a:b"], "first:last:count"),
        (["--gauge", "g36", "--mu", "0:1:100000000"], "first:last:count"),
        (["--gauge", "g36", "--noise", "0"], "--noise 0"),
        (["--gauge", "g36", "--noise", "1e300"], "--noise 1e+300"),
        (["--gauge", "g36", "--mu", "0.1,0.2,0.3,1e300"], "--mu: 1e+300"),
        (["--gauge", "g36", "--tolerance", "depth_mm=1e300"], "1e+06"),
        (["--gauge", "g36", "--resolution", "nan"], "--resolution nan"),
        (["--gauge", "g36", "--tolerance", "deep_mm=1"], '"depth_mm"'),
        (["--gauge", "g36", "--tolerance", "depth_mm"], "NAME=NUMBER"),
        (["--gauge", "g36", "--tolerance", "nu=-1"], "from 0 up"),
        (["--gauge", "g36", "--set", "gauge=[]"], "[[gauge]]"),
    ],
)
def test_mistakes_are_one_line_before_any_work(
    options: list[str], told: str, tmp_path: Path, scene_file: Path, capsys: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr(runs, "PressedBody", lambda *a: pytest.fail("work was done"))
    assert run("calibrate", scene_file, "--out", tmp_path / "cal", *options) == 2
    err = capsys.readouterr().err
    assert told in err
    assert len(err.splitlines()) == 1


def test_calibrate_prints_json_alone(tmp_path: Path, scene_file: Path, capsys: Any) -> None:
    none = [word for name in TOLERANCES for word in ("--tolerance", f"{name}=0")]
    options = ["--gauge", "g36", "--out", tmp_path / "cal", "--mu", ",".join(map(str, FEW)), "--json", *none]
    assert run("calibrate", scene_file, *options) == 0
    assert json.loads(capsys.readouterr().out)["mu"] == list(FEW)


def test_the_help_names_every_tolerance(capsys: Any) -> None:
    assert run("calibrate", "--help") == 0
    assert set(TOLERANCES) <= set(re.findall(r"\w+", capsys.readouterr().out))
