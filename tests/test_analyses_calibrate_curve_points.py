"""What the presses of a calibration have in common."""

from __future__ import annotations

from dataclasses import replace

from finger3d.analyses.calibrate.curve_points import CurvePoints
from finger3d.analyses.calibrate.increments import Increments
from finger3d.analyses.pressed_body import press
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.build import build
from tests.sensor_cases import scene


def test_a_press_that_fails_gives_a_reason_and_no_reading() -> None:
    problem = build(scene(model={"domain": "plane-strain"}, mesh={"size_mm": 4.0, "base_size_mm": 16.0}).model())
    good, bad = press(problem, 0.1), press(problem, 0.5)
    bad = replace(bad, frame=replace(bad.frame, outcome=Outcome.NO_CONVERGENCE))
    legs = problem.model.legs
    curve = CurvePoints(problem, (0.1, 0.5), Increments(legs, False, 0.0), (good, bad), {}, 3)
    assert list(curve.frames) == [0.1]
    assert list(curve.failed) == [0.5]
    assert curve.failed[0.5].startswith("at a depth of 10 mm: ")
    assert curve.reading("g36").tolist() == [good.frame.gauges["g36"]]
    assert curve.factorizations == 3 + 1  # small strain: only the build factors
