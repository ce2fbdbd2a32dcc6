"""Commands of the sensor: calibrate, estimate, identify and optimise."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from finger3d.analyses import pressed_body as pressing
from finger3d.analyses.calibrate import TOLERANCES
from finger3d.analyses.calibrate import run as runs
from finger3d.analyses.calibrate.run import calibrate
from finger3d.analyses.identify.presses import Simulation
from finger3d.analyses.reduced import ReducedModel
from finger3d.cli import main
from finger3d.cli.options import parsed_tolerances
from finger3d.errors import Finger3dError, MissingError, Outcome
from finger3d.sensor import Calibration, load, save
from tests.commands import refused, run
from tests.identify_cases import FREE, PRESS, bench
from tests.scenes import BLOCK, written
from tests.sensor_cases import FEW, NONE, curve, opposite, scene, straight

# --- option --tolerance ----------------------------------------------------------------------------------------------


def test_names_and_numbers_are_read_and_the_last_counts() -> None:
    assert parsed_tolerances(None) == {}
    assert parsed_tolerances(["depth_mm=0.05", " nu = 1e-3", "depth_mm=0.1"]) == {"depth_mm": 0.1, "nu": 1e-3}


@pytest.mark.parametrize("text", ["depth_mm", "depth_mm=", "depth_mm=a", "depth_mm=1=2"])
def test_what_is_no_number_is_refused(text: str) -> None:
    with pytest.raises(Finger3dError, match=f"--tolerance {text}: .*NAME=NUMBER"):
        parsed_tolerances([text])


# --- command ``calibrate``: files, JSON, refusals, and what is kept when something fails -----------------------------


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
    assert run("calibrate", scene_file, "--gauge", "g36", "--out", out, "--mu", "0:0.8:9", *options) == 0
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
                     "scene.toml"}  # fmt: skip
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
        (["--gauge", "g36", "--mu", "0,0,0,0"], "1 different"),
        (["--gauge", "g36", "--mu", "a:b"], "first:last:count"),
        (["--gauge", "g36", "--noise", "0"], "--noise 0"),
        (["--gauge", "g36", "--mu", "0.1,0.2,0.3,1e300"], "--mu: 1e+300"),
        (["--gauge", "g36", "--tolerance", "deep_mm=1"], '"depth_mm"'),
        (["--gauge", "g36", "--tolerance", "depth_mm"], "NAME=NUMBER"),
        (["--gauge", "g36", "--set", "gauge=[]"], "[[gauge]]"),
    ],
)
def test_mistakes_are_one_line_before_any_work(
    options: list[str], told: str, tmp_path: Path, scene_file: Path, capsys: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr(runs, "PressedBody", lambda *a: pytest.fail("work was done"))
    assert told in refused(capsys, "calibrate", scene_file, "--out", tmp_path / "cal", *options)


def test_calibrate_prints_json_alone(tmp_path: Path, scene_file: Path, capsys: Any) -> None:
    none = [word for name in TOLERANCES for word in ("--tolerance", f"{name}=0")]
    options = ["--gauge", "g36", "--out", tmp_path / "cal", "--mu", ",".join(map(str, FEW)), "--json", *none]
    assert run("calibrate", scene_file, *options) == 0
    assert json.loads(capsys.readouterr().out)["mu"] == list(FEW)


# --- command ``estimate``: readings on the command line and in files, and what is refused ----------------------------


def test_many_readings_from_a_csv(tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    readings = tmp_path / "readings.csv"
    readings.write_text(f"time,strain,std\n0,{straight(0.3)!r},1e-5\n1,0.2,1e-5\n")
    assert run("estimate", kept, "--csv", readings) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    assert float(rows[0]["mu"]) == pytest.approx(0.3, abs=2e-3)
    assert rows[1]["status"] == "outside"
    assert run("estimate", kept, "--csv", readings, "--out", tmp_path / "mu.csv") == 0
    assert "1 of 2 readings" in capsys.readouterr().out
    assert len((tmp_path / "mu.csv").read_text().splitlines()) == 3
    assert run("estimate", kept, "--csv", readings, "--json") == 0
    assert [a["status"] for a in json.loads(capsys.readouterr().out)] == ["ok", "outside"]


@pytest.mark.parametrize(
    ("text", "options", "told"),
    [
        ("strain\n0.01\nabc\n", [], "line 3: strain = 'abc'"),
        ("strain\n1,25,7\n", [], "line 2: strain = '1,25,7': must be a finite number; it has more cells than names"),
        ("x\n1\n", [], "a column named g or strain "),
        ("", [], "reading"),
        ("strain\n0.01\n", ["--strain", "0.1"], "--csv"),
    ],
)
def test_mistakes_in_readings(text: str, options: list[str], told: str, tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    (tmp_path / "readings.csv").write_text(text)
    assert told in refused(capsys, "estimate", kept, "--csv", tmp_path / "readings.csv", *options)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_are_read_from_files_and_streams(separator: str, tmp_path: Path, capsys: Any) -> None:
    kept, path = save(curve(straight), tmp_path / "calibration.json"), tmp_path / "readings.csv"
    text = f"# bench\nOperator{separator}Max\nstrain;std\n{straight(0.3):.6f};0,00001\n"
    path.write_text(text.replace(".", ",").replace(";", separator))
    assert run("estimate", kept, "--csv", path) == 0
    said = capsys.readouterr().out
    (row,) = csv.DictReader(io.StringIO(said))
    assert float(row["mu"]) == pytest.approx(0.3, abs=2e-3)
    child = follow(kept, "--follow", "-", stdin=subprocess.PIPE)
    assert child.communicate(path.read_text())[0] == said


def test_estimate_of_nan_and_of_nothing(tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    for options, said in ((["nan"], "g = nan"), (["1e300"], "1e+300"), (["0.01", "--std", "1e300"], "1e+300")):
        assert said in refused(capsys, "estimate", kept, "--strain", *options)
    assert run("estimate", kept) == 2
    assert run("estimate", kept, "--strain", "0.1", "--out", tmp_path / "x.csv") == 2


@pytest.fixture
def joint() -> Calibration:
    return opposite()


def test_the_command_takes_readings_by_name(tmp_path: Path, joint: Calibration, capsys: Any) -> None:
    kept = save(joint, tmp_path / "calibration.json")
    a, b = (repr(float(v)) for v in joint.at([0.4])[0])
    assert run("estimate", kept, "--strain", f"a={a}", "--strain", f"b={b}", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["mu"] == pytest.approx(0.4, abs=0.01)
    assert found["readings"] == {"a": float(a), "b": float(b)}
    assert run("estimate", kept, "--strain", f"a={a}", "--strain", f"b={b}", "--std", "1e-3", "--std", "b=1e-3") == 2
    assert "--std b" in capsys.readouterr().err
    assert run("estimate", kept, "--strain", f"a={a}", "--strain", f"b={float(b) + 0.03}") == 0
    assert "0.02 to 1.2" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--strain", "0.05"), "--strain a=0.05"),
        (("--strain", "c=0.05"), "--strain c=0.05: c "),
        (("--strain", "a=much"), "NAME=NUMBER"),
        (("--strain", "a=0.05", "--strain", "a=0.06"), "--strain a=0.06: a "),
    ],
)
def test_commands_that_are_refused(
    tmp_path: Path, joint: Calibration, capsys: Any, options: tuple[str, ...], told: str
) -> None:
    kept = save(joint, tmp_path / "calibration.json")
    assert told in refused(capsys, "estimate", kept, *options)


def test_a_file_has_a_column_for_every_reading(tmp_path: Path, joint: Calibration, capsys: Any) -> None:
    kept, readings = save(joint, tmp_path / "calibration.json"), tmp_path / "readings.csv"
    rows = joint.at([0.3, 0.7])
    readings.write_text("time,b,a,a_std\n" + "".join(f"0,{b!r},{a!r},1e-4\n" for a, b in rows.tolist()))
    assert run("estimate", kept, "--csv", readings) == 0
    found = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [float(row["mu"]) for row in found] == pytest.approx([0.3, 0.7], abs=0.01)
    assert [float(row["a"]) for row in found] == list(rows[:, 0])
    assert run("estimate", kept, "--csv", readings, "--out", tmp_path / "mu.csv") == 0
    assert "2 of 2 readings" in capsys.readouterr().out
    readings.write_text("time,b\n0,0.05\n")
    assert run("estimate", kept, "--csv", readings) == 2
    assert "named a " in capsys.readouterr().err


def follow(*arguments: object, **options: object) -> subprocess.Popen:
    command = [sys.executable, "-m", "finger3d", "estimate", *map(str, arguments)]
    options = {"text": True, **options}
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)


def test_readings_are_answered_as_they_are_written(tmp_path: Path) -> None:
    kept, readings = save(curve(straight), tmp_path / "calibration.json"), tmp_path / "readings.csv"
    readings.write_text("time,strain\n")
    child = follow(kept, "--follow", readings)
    try:
        assert child.stdout.readline().startswith("g,mu,std,low,high,status,")
        for mu in (0.2, 0.4):
            text = f"1,{straight(mu)!r}\n"
            with readings.open("a") as stream:
                stream.write(text[:7])
                stream.flush()
                time.sleep(0.1)  # half a line is no reading
                stream.write(text[7:])
            assert float(child.stdout.readline().split(",")[1]) == pytest.approx(mu, abs=0.02)
    finally:
        child.send_signal(2)
        assert child.wait(timeout=60) == 130


def test_a_stream_without_the_readings_column_is_refused_with_one_line(tmp_path: Path) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    child = follow(kept, "--follow", "-", stdin=subprocess.PIPE)
    out, error = child.communicate("\33[31mx\n1\n")
    assert child.returncode == 2
    assert "g or strain" in error
    assert "\33" not in error  # names of a stranger's file do not reach the terminal as they are
    assert len(error.splitlines()) == 1
    assert len(out.splitlines()) == 1


def test_lines_that_are_no_readings_are_answered_and_the_stream_goes_on(tmp_path: Path) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    child = follow(kept, "--follow", "-", stdin=subprocess.PIPE, text=False)
    good, long = repr(straight(0.3)).encode(), b"1" * 200_000
    bad = {b"abc,1": "line 2: strain = 'abc'", b"nan,1e-5": "line 3: strain = 'nan'", b"\xff": "line 4: has 1 cells",
           long: "line 5: field larger than", b'"0.1': "line 6: unexpected end", good + b",-1": "std of g = -1.0",
           b"\0\0": "zero bytes"}  # fmt: skip
    text = b"\xef\xbb\xbfstrain,std\n" + b"".join(line + b"\n" for line in bad) + good + b",1e-5\n"
    out, error = child.communicate(text)
    assert (child.returncode, error) == (0, b"")
    *rows, last = list(csv.DictReader(io.StringIO(out.decode())))
    assert [row["status"] for row in rows] == ["invalid"] * len(bad)
    assert all(said in row["verdict"] for row, said in zip(rows, bad.values(), strict=True))
    assert float(last["mu"]) == pytest.approx(0.3, abs=2e-3)


def test_standard_input_is_answered_until_it_ends(tmp_path: Path) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    child = follow(kept, "--follow", "-", stdin=subprocess.PIPE)
    out, error = child.communicate(f"strain\n{straight(0.3)!r}\n0.2\n")
    assert (child.returncode, error) == (0, "")
    rows = list(csv.DictReader(out.splitlines()))
    assert float(rows[0]["mu"]) == pytest.approx(0.3, abs=2e-3)
    assert rows[1]["status"] == "outside"


@pytest.mark.parametrize("how", ["rotated", "truncated without names"])
def test_a_file_that_is_replaced_or_cut_is_followed_from_its_start(tmp_path: Path, how: str) -> None:
    kept, readings = save(curve(straight), tmp_path / "calibration.json"), tmp_path / "readings.csv"
    readings.write_text(f"time,strain\n0,{straight(0.2)!r}\n1,{straight(0.2)!r}\n")
    child = follow(kept, "--follow", readings)
    try:
        assert len([child.stdout.readline() for _ in range(3)]) == 3
        names = "" if "without" in how else "time,strain\n"
        text = f"{names}0,{straight(0.7)!r}\n"
        if how == "rotated":
            readings.rename(tmp_path / "readings.1.csv")
            readings.write_text(text)
        else:
            os.truncate(readings, 0)
            time.sleep(0.3)
            readings.write_text(text)
        assert float(child.stdout.readline().split(",")[1]) == pytest.approx(0.7, abs=0.02)
    finally:
        child.send_signal(2)
        assert child.wait(timeout=60) == 130


# --- command ``identify``: what is refused ---------------------------------------------------------------------------


@pytest.fixture
def pressed_scene(tmp_path: Path) -> Path:
    return written(tmp_path, scene(press=PRESS).to_toml())


@pytest.mark.parametrize(
    ("factor", "free", "told"),
    [
        (1000.0, FREE, "line 9: gauge_g36 ="),
        (-1.0, FREE, "of the opposite sign"),
        (1.0, {"press.depth_mm": (5.0, 6.0)}, "5"),
        (1.0, {"depth_offset_mm": (-1.0, 0.3)}, "line 9: depth_mm = 10: with depth_offset_mm = 0.3 it is 10.3, and "),
        (1.0, {"gauge.x.x_mm": (1.0, 2.0)}, '"x"'),
    ],
)
def test_identifications_that_are_refused(
    tmp_path: Path, pressed_scene: Path, capsys: Any, factor: float, free: Any, told: str
) -> None:
    rows = list(csv.DictReader(bench(tmp_path / "all.csv").open()))
    measured = tmp_path / "bench.csv"
    lines = [f"{r['depth_mm']},{r['normal_force_N']},{factor * float(r['gauge_g36'])}" for r in rows]
    measured.write_text("depth_mm,normal_force_N,gauge_g36\n" + "\n".join(lines) + "\n")
    options = [text for key, (low, high) in free.items() for text in ("--free", f"{key}={low}:{high}")]
    command = ["identify", str(pressed_scene), "--measured", str(measured), "--out", str(tmp_path / "out"), *options]
    assert main(command) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert told in said


def test_rows_beyond_the_path_are_refused_before_anything_is_solved(
    tmp_path: Path, pressed_scene: Path, capsys: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr(Simulation, "_solve", lambda *_: pytest.fail("a press was solved"))
    measured = tmp_path / "bench.csv"
    for depths, told in (("1.0 12.5", "line 3: depth_mm = 12.5: the path of the scene ends at 10"),
                         ("0.005 0.01", "are the depths in mm?")):  # fmt: skip
        measured.write_text("depth_mm,normal_force_N\n" + "".join(f"{d},{i}\n" for i, d in enumerate(depths.split())))
        command = ["identify", str(pressed_scene), "--measured", str(measured), "--out", str(tmp_path / "out")]
        assert main([*command, "--free", "material.E_MPa=0.1:1"]) == 2
        assert told in capsys.readouterr().err


# --- command ``optimise``: the best design as JSON, and what is refused ----------------------


SETS = ["model.domain=plane-strain", "mesh.size_mm=4", "mesh.base_size_mm=16", "press.steps=10"]
COARSE = [option for text in SETS for option in ("--set", text)]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--gauges", "0"), "--gauges 0: "),
        (("--gauges", "2", "--free", "finger.radius_mm=60:200"), "--gauges"),
        (("--gauges", "2", "--mu", "0.1,0.2"), "three"),
        (("--gauges", "2", "--free", "gauge.y_mm=-9:0"), "--free gauge.y_mm=-9:0: no gauge"),
    ],
)
def test_what_is_refused(tmp_path: Path, capsys: Any, options: tuple[str, ...], told: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml())
    assert told in refused(capsys, "optimise", path, "--out", tmp_path / "out", *options)


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


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--free", "finger.radius_mm"], "KEY=LOW:HIGH"),
        (["--free", "finger.radius_mm=200:60"], "LOW"),
        (["--free", "gauge.g9.x_mm=1:2"], '"g9"'),
        (["--free", "gauge.g36.x_mm=1:2", "--free", "gauge.0.x_mm=1:3"], "gauge.0.x_mm"),
        (["--free", "gauge.g36.x_mm=1:2", "--gauge", "g9"], "--gauge g9"),
        (["--free", "gauge.g36.x_mm=1:2", "--budget", "0"], "--budget 0"),
        (["--free", "gauge.g36.x_mm=1:2", "--mu", "0.5,0.1"], "ascending"),
    ],
)
def test_bad_input_is_one_line(options, expected, root, tmp_path, capsys) -> None:
    scene = root / "geometries" / "fig9.toml"
    assert run("optimise", scene, *COARSE, *options, "--out", tmp_path / "out") == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert expected in err
