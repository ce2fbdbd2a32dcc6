"""Strain fields from which any gauge is read."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.optimise.gauge_fields import GaugeFields, StrainField
from finger3d.analyses.pressed_body import presses
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.progress import QUIET
from tests.sensor_cases import NONE, scene

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
    fields = GaugeFields.of(model, mus, 1.5e-4, given, QUIET)
    joint, _ = calibrated(replace(model, gauges=gauges), ["g0", "g1"], mus, tolerances=FEW)
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
