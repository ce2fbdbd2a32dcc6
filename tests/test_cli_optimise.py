"""Command ``optimise``: the best design as JSON, objectives from a file, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from finger3d.cli import main
from finger3d.scene import load
from tests.scenes import BLOCK, written
from tests.sensor_cases import scene

SETS = ["model.domain=plane-strain", "mesh.size_mm=4", "mesh.base_size_mm=16", "press.steps=10"]
COARSE = [option for text in SETS for option in ("--set", text)]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--gauges", "0"), "--gauges 0: "),
        (("--gauges", "2", "--free", "finger.radius_mm=60:200"), "--gauges"),
        (("--gauges", "2", "--tolerance", "depht_mm=1"), '"depth_mm"'),
        (("--gauges", "2", "--mu", "0.1,0.2"), "three"),
        (("--gauges", "2", "--free", "gauge.x_mm=100:200"), "--free gauge.x_mm=100:200: no gauge"),
        (("--gauges", "2", "--free", "gauge.y_mm=-9:0"), "--free gauge.y_mm=-9:0: no gauge"),
        (("--gauges", "2", "--noise", "1e300"), "--noise 1e+300: must be a finite number from 1e-12 to 1000"),
    ],
)
def test_what_is_refused(tmp_path: Path, capsys: Any, options: tuple[str, ...], told: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml())
    assert main(["optimise", str(path), "--out", str(tmp_path / "out"), *options]) == 2
    said = capsys.readouterr().err.strip()
    assert told in said
    assert "\n" not in said


def test_foils_are_refused(tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "scene.toml"
    effects = {"embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.05, "width_mm": 2.0}}
    path.write_text(scene(effects=effects, gauge=[scene().as_dict()["gauge"][1]]).to_toml())
    assert main(["optimise", str(path), "--out", str(tmp_path / "out"), "--gauges", "2"]) == 2
    assert "effects.embedded_gauge" in capsys.readouterr().err


@pytest.fixture
def block(tmp_path: Path) -> Path:
    return written(tmp_path, BLOCK)


def test_design_prints_json_alone(block: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    few = ["--free", "gauge.g.angle_deg=0:90", "--budget", "3", "--mu", "0.1,0.5", "--json"]
    assert main(["optimise", str(block), *few, "--out", str(tmp_path / "out")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == json.loads((tmp_path / "out" / "design.json").read_text(encoding="utf-8"))
    assert found["best"] >= found["start"]
    assert 0.0 <= found["values"]["gauge.g.angle_deg"] <= 90.0


def test_an_objective_from_a_file_on_the_command_line(root, tmp_path, capsys) -> None:
    judge = tmp_path / "judge.py"
    judge.write_text("def objective(table):\n    return -abs(table.scene.tables.gauge[0].angle_deg - 40.0)\n")
    scene, out = root / "geometries" / "fig9.toml", tmp_path / "out"
    arguments = ["optimise", str(scene), *COARSE, "--free", "gauge.g36.angle_deg=0:90", "--out", str(out)]
    assert main([*arguments, "--objective", str(judge), "--budget", "40", "--mu", "0.1,0.5"]) == 0
    told = capsys.readouterr().out
    assert "best.toml" in told
    assert "objective (judge.py)" in told
    judged = (out / "evaluations.csv").read_text().splitlines()[1:]
    assert f" {len(judged)} designs, " in told
    assert load(out / "best.toml").tables.gauge[0].angle_deg == pytest.approx(40.0, abs=2.0)
    judge.write_text("def objective(table):\n    return table.strains\n")
    assert main([*arguments[:-1], str(tmp_path / "other"), "--objective", str(judge)]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert "AttributeError" in err


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--free", "finger.radius_mm"], "KEY=LOW:HIGH"),
        (["--free", "finger.radius_mm=200:60"], "LOW"),
        (["--free", "finger.radius_mm=60:inf"], "KEY=LOW:HIGH"),
        (["--free", "finger.radus_mm=60:200"], '"radius_mm"'),
        (["--free", "gauge.g9.x_mm=1:2"], '"g9"'),
        (["--free", "gauge.g36.x_mm=1:2", "--free", "gauge.0.x_mm=1:3"], "gauge.0.x_mm"),
        (["--free", "gauge.g36.x_mm=1:2", "--gauge", "g9"], "--gauge g9"),
        (["--free", "gauge.g36.x_mm=1:2", "--objective", "best"], "sensitivity"),
        (["--free", "gauge.g36.x_mm=1:2", "--budget", "0"], "--budget 0"),
        (["--free", "gauge.g36.x_mm=1:2", "--mu", "0.5,0.1"], "ascending"),
        (["--free", "gauge.g36.x_mm=1:2", "--noise", "0"], "--noise 0"),
        (["--free", "gauge.g36.x_mm=1:2", "--noise", "1e300"], "--noise 1e+300: must be a finite number"),
        (["--free", "gauge.g36.x_mm=1:2", "--seed", "-1"], "--seed -1: must be a whole number from 0 up"),
    ],
)
def test_bad_input_is_one_line(options, expected, root, tmp_path, capsys) -> None:
    scene = root / "geometries" / "fig9.toml"
    assert main(["optimise", str(scene), *COARSE, *options, "--out", str(tmp_path / "out")]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert expected in err
