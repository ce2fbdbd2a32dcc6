"""Pages of calibrations."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from finger3d.report.calibrate import calibrate_page
from finger3d.sensor import save
from tests.commands import run
from tests.scenes import words
from tests.sensor_cases import curve, line, scene, straight, together, tolerance

SCENE: dict[str, Any] = {"scene": scene().as_dict() | {"title": "<b>a finger</b>"}}


def test_a_gauges_page_tells_range_curve_causes_and_a_command_that_succeeds(tmp_path: Path, capsys: Any) -> None:
    made = curve(line(0.05), tolerances=(tolerance("depth_mm", 0.1, 1e-3),), failed=((0.9, "no convergence"),), **SCENE)
    save(made, tmp_path / "calibration.json")
    text = words(calibrate_page(tmp_path))
    assert "<b>a finger</b>: g against friction" in text
    assert made.verdict() in text
    low, high = made.trusted[0]
    assert f"{low:.3g} to {high:.3g}" in text
    assert "mu = 0.9: no convergence" in text
    assert "depth_mm" in text
    command = re.search(r"finger3d (estimate \S+ --strain g=\S+)", text)
    assert command
    assert run(*command[1].split()) == 0
    found = re.match(r"mu = (\S+) \+- (\S+) \(", capsys.readouterr().out)
    assert found
    assert float(found[1]) == pytest.approx(made.mu[made.best], abs=0.01)
    assert f"mu = {made.mu[made.best]:.3g}, all tolerances {found[2]} " in text


def test_the_page_of_a_gauge_that_knows_mu_nowhere_gives_no_range(tmp_path: Path) -> None:
    save(curve(lambda mu: 0.0 * mu, **SCENE), tmp_path / "calibration.json")
    page = calibrate_page(tmp_path).read_text(encoding="utf-8")
    assert page.count("<dd>none</dd>") == 2  # with all tolerances, and by the noise alone
    assert "<dd>unknown</dd>" in page


def test_a_page_of_several_readings_tells_each_and_what_would_reduce_the_variance(tmp_path: Path) -> None:
    depth = tolerance("depth_mm", 0.1, 0.02)
    joint = replace(together(curve(line(0.01), tolerances=(depth,)), curve(straight, tolerances=(depth,))), **SCENE)
    save(joint, tmp_path / "calibration.json")
    text = words(calibrate_page(tmp_path))
    best = joint.best
    assert re.search(rf"mu = {joint.mu[best]:.3g}\b[^=]* {joint.judged_at_mu[best].std:.2g}\b", text)
    fall = joint.reductions(joint.mu)["depth_mm"][best]
    assert f"depth_mm {100.0 * fall:.1f} %" in text
    assert "--strain a=" in text
    assert "--strain b=" in text
