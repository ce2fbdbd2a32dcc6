"""Pages of calibrations."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from finger3d.report.calibrate import calibrate_page, joint_calibration_page
from finger3d.sensor import save
from tests.scenes import words
from tests.sensor_cases import curve, line, scene, straight, together, tolerance

SCENE: dict[str, Any] = {"scene": scene().as_dict() | {"title": "<b>a finger</b>"}}


def test_a_gauges_page_tells_range_curve_causes_and_the_command_that_uses_it(tmp_path: Path) -> None:
    made = curve(line(0.05), tolerances=(tolerance("depth_mm", 0.1, 1e-3),), failed=((0.9, "no convergence"),), **SCENE)
    save(made, tmp_path / "calibration.json")
    text = words(calibrate_page(tmp_path))
    assert "<b>a finger</b>: " in text
    assert made.verdict() in text
    low, high = made.trusted[0].low, made.trusted[0].high
    assert f"{low:.3g} to {high:.3g}" in text
    assert "mu = 0.9: no convergence" in text
    assert "depth_mm 0.1" in text
    middle = float(made.reading[len(made.mu) // 2])
    assert f"finger3d estimate {tmp_path}/calibration.json --strain {middle:.4g}" in text


def test_the_page_of_a_gauge_that_knows_mu_nowhere_gives_no_range(tmp_path: Path) -> None:
    save(curve(lambda mu: 0.0 * mu, **SCENE), tmp_path / "calibration.json")
    page = calibrate_page(tmp_path).read_text(encoding="utf-8")
    assert page.count("<dd>none</dd>") == 2  # with all tolerances, and by strain noise alone


def test_a_joint_page_tells_every_reading_and_what_would_reduce_the_variance(tmp_path: Path) -> None:
    depth = tolerance("depth_mm", 0.1, 0.02)
    joint = together(curve(line(0.01), tolerances=(depth,)), curve(straight, tolerances=(depth,)))
    joint = type(joint)(joint.readings, joint.limit, **SCENE)
    save(joint, tmp_path / "calibration.json")
    text = words(joint_calibration_page(tmp_path))
    best = joint.mu_sd(joint.mu).argmin()
    assert re.search(rf"mu = {joint.mu[best]:.3g}\b[^=]* {joint.mu_sd(joint.mu)[best]:.2g}\b", text)
    fall = joint.reductions(joint.mu)["depth_mm"][best]
    assert f"depth_mm {100.0 * fall:.1f} %" in text
    assert "--strain a=" in text
    assert "--strain b=" in text
