"""Advice: changes by large deformation, told where they are known, beside the same press."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d.accuracy import model_error as module
from finger3d.accuracy.advice import advise, largest_principal_strain
from finger3d.accuracy.changes import Change, ChangeEstimate
from finger3d.cli import main
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.report.press import press_page
from tests.models import half_cylinder
from tests.scenes import HALF_CYLINDER, changed, words, written

COARSE = 0.3
SHALLOW = changed(HALF_CYLINDER, steps=5, size_mm=0.2)
DEEP = changed(HALF_CYLINDER, depth_mm=1.0, size_mm=0.2)
"""Principal strains of about 0.2."""


def test_a_line_of_advice_tells_changes_with_their_intervals() -> None:
    changes = {
        "normal_force_N": Change(10.0, 1.9, 0.2, 10.0),
        "friction_sum_N": Change(4.0, 1.0, 0.9, 4.0),
        "gauge_a": Change(-0.02, 0.0058, 0.0004, 0.02),  # its magnitude falls
        "gauge_b": Change(0.001, 0.01, 0.001, 0.02),
        "gauge_c": Change(0.01, 0.001, 0.0001, 0.02),
        "gauge_d": Change(0.01, 0.002, 0.0001, 0.02),
    }
    model = replace(half_cylinder(COARSE), gauges=tuple(Gauge(name, 1.0, 4.0) for name in "abcd"))
    large = advise(model, 0.2, ChangeEstimate(changes=changes))[0]
    told = [
        "+19 % (+17 to +21 %)", "gauge_b by +0.01 (+0.009 to +0.011)", "gauge_a by -29 % (-31 to -27 %)",
        "gauge_d by +20 % (+19 to +21 %)", "[effects.large_deformation]",
    ]  # fmt: skip
    places = [large.index(text) for text in told]
    assert places == sorted(places)
    assert not any(name in large for name in ("friction", "gauge_c"))


def test_without_a_known_change_no_number_is_told() -> None:
    model, unknown = half_cylinder(COARSE), {"normal_force_N": Change(10.0, 1.9, 2.0, 10.0)}
    for estimate in (None, ChangeEstimate(method="no estimate: why"), ChangeEstimate(changes=unknown)):
        line, *_ = advise(model, 0.2, estimate)
        assert "0.2" in line
        assert "[effects.large_deformation]" in line
        assert "%" not in line
        assert not any("%" in line for line in advise(model, 0.06, estimate))
    assert not any("large_deformation" in line for line in advise(LargeDeformation().apply(model), 0.2))


def test_the_singular_corners_do_not_count_as_strain() -> None:
    strain = np.zeros((1000, 3, 3))
    strain[:, 0, 0] = -0.07
    strain[:5] *= 100.0
    assert largest_principal_strain(strain) == pytest.approx(0.07, rel=1e-12)


def test_a_press_tells_what_large_deformation_would_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(DEEP, encoding="utf-8")
    told = finger3d.press(scene, tmp_path / "told", figures=False).summary()
    found = json.loads((tmp_path / "told" / "summary.json").read_text(encoding="utf-8"))["model_error"]
    force = found["large_deformation"]["normal_force_N"]
    assert set(force) == {"change", "low", "high"}
    value = told["steps"][-1]["normal_force_N"]
    line = next(text for text in told["advice"] if "[effects.large_deformation]" in text)
    assert f" {float(format(100.0 * force['change'] / value, '.2g')):+g} % (" in line
    page = words(press_page(tmp_path / "told"))
    assert f"normal_force_N {force['change']:.5g} {force['low']:.5g} {force['high']:.5g}" in page

    def forbidden(*_: Any) -> Any:
        raise AssertionError("estimated under --no-error")

    monkeypatch.setattr(module, "Judgement", forbidden)
    alone = finger3d.press(scene, tmp_path / "alone", error=False).summary()
    assert alone["steps"] == told["steps"]  # to the last digit
    assert alone["model_error"] == {}
    assert any("[effects.large_deformation]" in text for text in alone["advice"])


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
        assert main(["press", str(written(tmp_path, SHALLOW)), "--out", str(out), "--no-figures", *settings]) == 0
        said[name] = " ".join(json.loads((out / "summary.json").read_text(encoding="utf-8"))["advice"])
    assert "% (" in said["small"]
    assert "% (" in said["viscous"]
    assert "[effects.large_deformation]" in said["small"]
    assert "[effects.large_deformation]" in said["viscous"]
    assert "large_deformation" not in said["large"]
    assert "% (" not in said["large"] + said["auto"]
    assert "finger3d compare" in said["large"]
