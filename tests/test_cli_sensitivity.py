"""Command ``sensitivity``: its files, and mistakes in one line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from finger3d.cli import main
from tests.sensor_cases import scene
from tests.test_analyses_sensitivity import HOLD

SECTION = {
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 3.0, "base_size_mm": 10.0},
    "friction": {"mu": 0.4},
}


def test_the_command_writes_table_json_and_figure(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(scene(**SECTION).to_toml(), encoding="utf-8")
    out = tmp_path / "out"
    assert main(["sensitivity", str(file), "--of", "gauge_g36,stick_area_mm2", "--out", str(out)]) == 0
    assert "finger.radius_mm" in capsys.readouterr().out
    found = json.loads((out / "sensitivity.json").read_text())
    assert set(found["derivatives"]) == {"gauge_g36", "stick_area_mm2"}
    assert found["tolerances"]["press.depth_mm"] == 0.1
    assert {p.name for p in out.iterdir()} >= {"sensitivity.csv", "sensitivity.png"}


def test_at_a_kink_the_table_has_both_derivatives(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(scene(**SECTION | HOLD).to_toml(), encoding="utf-8")
    out = tmp_path / "out"
    assert main(["sensitivity", str(file), "--of", "gauge_g36", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "derivative_falling" in printed
    assert "ends at a kink" in printed
    found = json.loads((out / "sensitivity.json").read_text())
    assert "press.leg.1.depth_mm" in found["derivatives_falling"]["gauge_g36"]


@pytest.mark.parametrize(
    ("of", "key", "text"),
    [
        ("gauge_g3", "friction.mu=0.4", "must be one of normal_force_N, friction_sum_N"),
        ("gauge_g36", "contact.rule=paper", "derivatives need contact.rule"),
    ],
)
def test_bad_input_is_one_line(of: str, key: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(scene(**SECTION).to_toml(), encoding="utf-8")
    assert main(["sensitivity", str(file), "--of", of, "--set", key, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert text in error
    assert error.count("\n") == 1
