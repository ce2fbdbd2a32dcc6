"""Command ``identify``: what is refused."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

from finger3d.analyses.identify.simulated import Simulation
from finger3d.cli import main
from tests.identify_cases import FREE, PRESS, bench
from tests.scenes import written
from tests.sensor_cases import scene


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    return written(tmp_path, scene(press=PRESS).to_toml())


@pytest.mark.parametrize(
    ("factor", "free", "told"),
    [
        (1000.0, FREE, "line 9: gauge_g36 ="),
        (1.0, {"material.E_MP": (0.05, 5.0)}, "E_MP"),
        (-1.0, FREE, "of the opposite sign"),
        (1.0, {"press.depth_mm": (5.0, 6.0)}, "5"),
        (1.0, {"depth_offset_mm": (-1.0, 0.3)}, "line 9: depth_mm = 10: with depth_offset_mm = 0.3 it is 10.3, and "),
        (1.0, {"gauge.x.x_mm": (1.0, 2.0)}, '"x"'),
    ],
)
def test_commands_that_are_refused(
    tmp_path: Path, scene_file: Path, capsys: Any, factor: float, free: Any, told: str
) -> None:
    rows = list(csv.DictReader(bench(tmp_path / "all.csv").open()))
    measured = tmp_path / "bench.csv"
    lines = [f"{r['depth_mm']},{r['normal_force_N']},{factor * float(r['gauge_g36'])}" for r in rows]
    measured.write_text("depth_mm,normal_force_N,gauge_g36\n" + "\n".join(lines) + "\n")
    options = [text for key, (low, high) in free.items() for text in ("--free", f"{key}={low}:{high}")]
    command = ["identify", str(scene_file), "--measured", str(measured), "--out", str(tmp_path / "out"), *options]
    assert main(command) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert told in said


def test_rows_beyond_the_path_are_refused_before_anything_is_solved(
    tmp_path: Path, scene_file: Path, capsys: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr(Simulation, "_solve", lambda *_: pytest.fail("a press was solved"))
    measured = tmp_path / "bench.csv"
    for depths, told in (("1.0 12.5", "line 3: depth_mm = 12.5: the path of the scene ends at 10"),
                         ("0.005 0.01", "are the depths in mm?")):  # fmt: skip
        measured.write_text("depth_mm,normal_force_N\n" + "".join(f"{d},{i}\n" for i, d in enumerate(depths.split())))
        command = ["identify", str(scene_file), "--measured", str(measured), "--out", str(tmp_path / "out")]
        assert main([*command, "--free", "material.E_MPa=0.1:1"]) == 2
        assert told in capsys.readouterr().err
