"""Places of several gauges for a scene."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import finger3d
from tests.sensor_cases import NONE, scene

MUS = (0.1, 0.25, 0.4, 0.55, 0.7)
FEW = {**NONE, "depth_mm": 0.1, "nu": 0.003, "gauge_x_mm": 0.3, "gauge_y_mm": 0.3, "gauge_angle_deg": 2.0}


def test_more_gauges_tell_more(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml())
    found = finger3d.place_gauges(path, 2, tmp_path / "out", mus=MUS, tolerances=FEW)
    data = json.loads((tmp_path / "out" / "gauges.json").read_text())
    first, second = data["gauges"]
    assert second["mean_mu_sd_with_those_before"] < first["mean_mu_sd_with_those_before"]
    assert found.found.objective == pytest.approx(data["mean_mu_sd"])
    assert math.dist(*([g[f"{axis}_mm"] for axis in "xyz"] for g in data["gauges"])) >= 3.0 - 1e-9
    for gauge in found.scene.model().gauges:
        assert abs(gauge.x_mm) < 50.0
        assert 0.0 < gauge.y_mm < 50.0
    # no single place of the grid is better than the polished pair with its partner
    for (_, values), gauges in zip(found.maps, found.found.gauges, strict=True):
        assert found.found.objective <= values.min() * 1.002
        assert np.isfinite(gauges.place).all()
    assert {"map.png", "map.csv", "best.toml", "report.html"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_bounds_of_the_region_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml())
    free = {"gauge.x_mm": (5.0, 20.0), "gauge.y_mm": (8.0, 25.0), "gauge.angle_deg": (20.0, 60.0)}
    found = finger3d.place_gauges(path, 1, tmp_path / "out", free, MUS, tolerances=FEW)
    (gauge,) = found.scene.model().gauges
    assert 5.0 <= gauge.x_mm <= 20.0
    assert 8.0 <= gauge.y_mm <= 25.0
    assert 20.0 - 1e-6 <= math.degrees(gauge.angle) <= 60.0 + 1e-6
