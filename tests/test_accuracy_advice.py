"""Advice after a press."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from finger3d.cli import main
from tests.scenes import HALF_CYLINDER, changed, written

SECTION = changed(HALF_CYLINDER, steps=5, size_mm=0.2)


@pytest.mark.slow
def test_advice_comes_with_numbers_and_goes_when_it_is_followed(tmp_path: Path) -> None:
    said = {}
    for name, keys in {
        "small": ["press.depth_mm=1.0"],
        "large": ["press.depth_mm=1.0", "effects.large_deformation={}", "press.steps=60"],
        "viscous": ["press.depth_mm=1.0", "press.duration_s=1.0", "effects.viscosity={prony=[[0.3, 0.5]]}"],
        "auto": ["press.steps=auto", "press.depth_mm=0.05"],
    }.items():
        out = tmp_path / name
        settings = [word for key in keys for word in ("--set", key)]
        assert main(["press", str(written(tmp_path)), "--out", str(out), "--no-figures", *settings]) == 0
        said[name] = " ".join(json.loads((out / "summary.json").read_text(encoding="utf-8"))["advice"])
    assert "[effects.large_deformation]" in said["small"]
    assert "[effects.large_deformation]" in said["viscous"]
    assert "large_deformation" not in said["large"]
    assert "increments" not in said["small"] + said["large"]
    assert "finger3d compare" in said["large"]
