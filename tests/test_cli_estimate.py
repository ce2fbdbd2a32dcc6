"""Command ``estimate``: readings on the command line and in files, and what is refused."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from finger3d.sensor import Calibration, save
from tests.commands import run
from tests.sensor_cases import curve, opposite, straight


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
    assert run("estimate", kept, "--csv", readings, "--json", "--curve", "fit") == 0
    assert [a["status"] for a in json.loads(capsys.readouterr().out)] == ["ok", "outside"]


@pytest.mark.parametrize(
    ("text", "options", "told"),
    [
        ("strain\n0.01\nabc\n", [], "line 3: strain = 'abc'"),
        ("strain\n0.01\nnan\n", [], "line 3: strain = 'nan': must be a finite number"),
        ("strain\n1,25,7\n", [], "line 2: strain = '1,25,7': must be a finite number; it has more cells than names"),
        ("time,strain\n0,0,061\n", [], "line 2: has 3 cells, and there are 2 columns"),
        ("x\n1\n", [], "a column named g or strain "),
        ("", [], "reading"),
        ("strain,std\n0.01,-1\n", [], "std of g = -1.0"),
        ("strain\n0.01\n", ["--strain", "0.1"], "--csv"),
    ],
)
def test_mistakes_in_readings(text: str, options: list[str], told: str, tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    (tmp_path / "readings.csv").write_text(text)
    assert run("estimate", kept, "--csv", tmp_path / "readings.csv", *options) == 2
    err = capsys.readouterr().err
    assert told in err
    assert len(err.splitlines()) == 1


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


@pytest.mark.parametrize("options", [["--strain", "1e300"], ["--strain", "0.01", "--std", "1e300"]])
def test_a_reading_that_would_overflow_is_refused(options: list[str], tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    assert run("estimate", kept, *options) == 2
    assert "1e+300" in capsys.readouterr().err


def test_estimate_of_nan_and_of_nothing(tmp_path: Path, capsys: Any) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    assert run("estimate", kept, "--strain", "nan") == 2
    assert "g = nan" in capsys.readouterr().err
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
        (("--strain", "a=nan", "--strain", "b=0.05"), "a = nan"),
        (("--strain", "a=0.05", "--std", "b=-1"), "std"),
    ],
)
def test_commands_that_are_refused(
    tmp_path: Path, joint: Calibration, capsys: Any, options: tuple[str, ...], told: str
) -> None:
    kept = save(joint, tmp_path / "calibration.json")
    assert run("estimate", kept, *options) == 2
    said = capsys.readouterr().err.strip()
    assert told in said
    assert "\n" not in said


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


@pytest.mark.parametrize("how", ["rotated", "truncated", "truncated without names"])
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


def test_standard_input_is_answered_until_it_ends(tmp_path: Path) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    child = follow(kept, "--follow", "-", stdin=subprocess.PIPE)
    out, error = child.communicate(f"strain\n{straight(0.3)!r}\n0.2\n")
    assert (child.returncode, error) == (0, "")
    rows = list(csv.DictReader(out.splitlines()))
    assert float(rows[0]["mu"]) == pytest.approx(0.3, abs=2e-3)
    assert rows[1]["status"] == "outside"
