"""Places of several gauges: read as gauges are, judged as a calibration judges, and better together."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d.analyses.calibrate.presses import presses
from finger3d.analyses.calibrate.run import calibrated_together
from finger3d.analyses.optimise.gauge_fields import GaugeFields, StrainField
from finger3d.analyses.optimise.gauge_search import Candidates, Region, objectives
from finger3d.mechanics.build import build
from finger3d.mechanics.gauges import Gauge
from finger3d.sensor.information import prior
from tests.sensor_cases import NONE, scene

MUS = (0.1, 0.25, 0.4, 0.55, 0.7)
FEW = {**NONE, "depth_mm": 0.1, "nu": 0.003, "gauge_x_mm": 0.3, "gauge_y_mm": 0.3, "gauge_angle_deg": 2.0}


@pytest.mark.parametrize("effects", [{}, {"large_deformation": {}}])
def test_a_field_reads_what_a_gauge_reads(effects: Any) -> None:
    model = scene(effects=effects).model()
    gauges = tuple(
        Gauge(f"g{i}", x, 30.0, angle=a) for i, (x, a) in enumerate(((-20.0, 0.3), (15.0, 2.0), (30.0, 0.0)))
    )
    problem = build(replace(model, gauges=gauges))
    frames = [p.frame for p in presses(problem, [0.2, 0.6])]
    field = StrainField.of_frames(problem, frames, (0.2, 0.6))
    for gauge in gauges:
        found = field.strain(np.array([gauge.middle]), np.array([gauge.angle]))[0, 0]
        assert found == pytest.approx([frame.gauges[gauge.name] for frame in frames], rel=1e-9)


def test_fields_judge_as_a_calibration_does() -> None:
    model = scene().model()
    gauges = tuple(Gauge(f"g{i}", x, 32.0, angle=a) for i, (x, a) in enumerate(((-25.0, 2.2), (25.0, 0.9))))
    mus = np.linspace(0.1, 0.7, 7)
    given = {name: sd for name, sd in FEW.items() if sd}
    fields = GaugeFields.of(model, mus, 1.5e-4, given, lambda text: None)
    joint, _ = calibrated_together(replace(model, gauges=gauges), ["g0", "g1"], mus, tolerances=FEW)
    for gauge, own in zip(gauges, joint.readings, strict=True):
        effects = fields.effects(np.array([gauge.middle]), np.array([gauge.angle]))
        strain = fields.nominal.strain(np.array([gauge.middle]), np.array([gauge.angle]))[0, 0]
        assert strain == pytest.approx(own.reading, rel=1e-9)
        assert effects.effects[0, :, 0] == pytest.approx(np.gradient(own.reading, mus), rel=1e-9)
        for tolerance in own.tolerances:
            if tolerance.name in fields.shared:
                column = 1 + list(fields.shared).index(tolerance.name)
                change = effects.effects[0, :, column]
                assert change == pytest.approx(tolerance.sd * tolerance.slope, rel=0.3, abs=2e-4)


def test_more_gauges_tell_more(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml())
    found = finger3d.place_gauges(path, 2, tmp_path / "out", mus=MUS, tolerances=FEW)
    data = json.loads((tmp_path / "out" / "gauges.json").read_text())
    first, second = data["gauges"]
    assert second["mean_mu_sd_with_those_before"] < first["mean_mu_sd_with_those_before"]
    assert found.found.objective == pytest.approx(data["mean_mu_sd"])
    for gauge in found.scene.model().gauges:
        assert abs(gauge.x_mm) < 50.0
        assert 0.0 < gauge.y_mm < 50.0
    # no single place of the grid is better than the polished pair with its partner
    for (_, values), gauges in zip(found.maps, found.found.gauges, strict=True):
        assert found.found.objective <= values.min() * 1.002
        assert np.isfinite(gauges.place).all()
    assert {"map.png", "map.csv", "best.toml", "report.html"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_the_first_gauge_is_the_best_of_all_candidates() -> None:
    fields = GaugeFields.of(scene().model(), MUS, 1.5e-4, {"depth_mm": 0.1}, lambda text: None)
    region = Region((10.0, 40.0), (10.0, 30.0), (0.0, 0.0), (0.0, math.pi))
    candidates = Candidates.of(fields, region.grid()[0], region.angles())
    base = prior(1, 0.2)
    values = objectives(base, candidates)
    # one by one, by the definition of the information
    for i in np.random.default_rng(0).integers(0, len(values), 20):
        one = base + candidates.effects.fisher[i]
        assert values[i] == pytest.approx(np.mean([np.sqrt(np.linalg.inv(f)[0, 0]) for f in one]))


def test_bounds_of_the_region_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml())
    free = {"gauge.x_mm": (5.0, 20.0), "gauge.y_mm": (8.0, 25.0), "gauge.angle_deg": (20.0, 60.0)}
    found = finger3d.place_gauges(path, 1, tmp_path / "out", free, MUS, tolerances=FEW)
    (gauge,) = found.scene.model().gauges
    assert 5.0 <= gauge.x_mm <= 20.0
    assert 8.0 <= gauge.y_mm <= 25.0
    assert 20.0 - 1e-6 <= math.degrees(gauge.angle) <= 60.0 + 1e-6
