"""The page of placed gauges."""

from __future__ import annotations

import json
from pathlib import Path

from finger3d.report.gauge_places import gauge_places_page
from tests.scenes import words
from tests.sensor_cases import scene


def test_every_gauge_with_its_place_and_the_command_that_calibrates_them(tmp_path: Path) -> None:
    gauge = {"z_mm": 0.0, "mean_mu_sd_alone": 0.05, "mean_mu_sd_with_those_before": 0.05}
    data = {
        "scene": scene().as_dict(), "mu": [0.1, 0.5], "mu_sd": [0.02, 0.04], "mean_mu_sd": 0.03,
        "gauges": [
            {"name": "g1", "x_mm": 30.25, "y_mm": 41.0, "angle_deg": 12.5, **gauge},
            {"name": "g2", "x_mm": -7.0, "y_mm": 20.0, "angle_deg": 90.0, **gauge},
        ],
    }  # fmt: skip
    (tmp_path / "gauges.json").write_text(json.dumps(data), encoding="utf-8")
    text = words(gauge_places_page(tmp_path))
    assert "2 gauges" in text
    assert "mu = 0.1 to 0.5 0.03" in text
    assert "g1 x 30.2, y 41.0, z 0.0 mm, 12.5°" in text
    assert f"finger3d calibrate {tmp_path / 'best.toml'} --gauge g1,g2" in text
    data["gauges"] = data["gauges"][:1]
    (tmp_path / "gauges.json").write_text(json.dumps(data), encoding="utf-8")
    assert "1 gauge " in words(gauge_places_page(tmp_path))
