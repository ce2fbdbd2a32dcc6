"""Command ``sensitivity``: its files, and mistakes in one line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from finger3d.cli import main
from tests.sensor_cases import scene

SECTION = {
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 3.0, "base_size_mm": 10.0},
    "friction": {"mu": 0.4},
}


def test_the_command_writes_table_json_and_figure(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(scene(**SECTION).to_toml(), encoding="utf-8")
    out = tmp_path / "out"
    options = ["--of", "gauge_g36,stick_area_mm2", "--tolerance", "gauge.g36.x_mm=0.5"]
    assert main(["sensitivity", str(file), *options, "--out", str(out)]) == 0
    assert "finger.radius_mm" in capsys.readouterr().out
    found = json.loads((out / "sensitivity.json").read_text())
    assert set(found["effects"]) == {"gauge_g36", "stick_area_mm2"}
    assert (found["changes"]["press.depth_mm"], found["changes"]["gauge.g36.x_mm"]) == (0.1, 0.5)
    effect = found["effects"]["gauge_g36"]["gauge.g36.x_mm"]
    assert effect["value"] == pytest.approx((effect["growing"] - effect["falling"]) / 1.0)
    assert set(effect) == {"value", "falling", "falling_error", "growing", "growing_error"}
    assert {p.name for p in out.iterdir()} >= {"sensitivity.csv", "sensitivity.png"}


@pytest.mark.parametrize(
    ("of", "key", "text"),
    [
        ("gauge_g3", "friction.mu=0.4", "must be one of normal_force_N, friction_sum_N"),
        ("gauge_g36", "friction.mu=-1", "friction.mu = -1"),
    ],
)
def test_bad_input_is_one_line(of: str, key: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(scene(**SECTION).to_toml(), encoding="utf-8")
    assert main(["sensitivity", str(file), "--of", of, "--set", key, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert text in error
    assert error.count("\n") == 1
