"""Command ``cost``: a table, JSON, a figure, and its mistakes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from finger3d.analyses.cost import ERRORS
from finger3d.cli import main
from tests.sensor_cases import scene

BASE = {
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 1.0, "base_size_mm": 4.0},
    "friction": {"mu": 0.4},
}


def test_the_command_prints_a_table_json_and_a_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, png = tmp_path / "scene.toml", tmp_path / "cost.png"
    path.write_text(scene(**BASE).to_toml())
    assert main(["cost", str(path), "--of", "gauge_g36,stick_area_mm2", "--png", str(png)]) == 0
    text = capsys.readouterr().out
    for words in ("this mesh", "0.3 %", "stick area mm2", "--set mesh.size_mm="):
        assert words in text
    assert png.stat().st_size > 10_000
    assert main(["cost", str(path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [row["error"] for row in data["rows"]] == [None, *ERRORS]
    assert set(data["of"]) == {"normal_force_N", "friction_sum_N", "gauge_g36", "gauge_long"}
    assert main(["cost", str(path), "--png", "cost.jpg"]) == 2
    assert main(["cost", str(path), "--of", "gauge"]) == 2
