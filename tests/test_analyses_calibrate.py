"""A calibration of the real body: the 68 % set covers the truth when the depth is off."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.reduced import ReducedModel
from finger3d.sensor import estimate
from tests.sensor_cases import NONE, scene

# --- the curve -------------------------------------------------------------------------------------------------------


# --- the inverse -----------------------------------------------------------------------------------------------------


def test_coverage_with_a_depth_that_is_off_by_presses_of_the_real_body() -> None:
    """Depth errors are pressed, not linearised; noise is drawn; the interval comes from the calibration's slopes."""
    model = scene().model()
    found, curve = calibrated(model, "g36", np.linspace(0.1, 1.0, 13), tolerances={**NONE, "depth_mm": 0.1})
    body = ReducedModel.of(curve.problem)
    random = np.random.default_rng(7)
    count = 250
    hits = 0
    for mu in random.uniform(0.2, 0.9, count):
        legs = [replace(leg, depth_mm=leg.depth_mm + random.normal(0.0, 0.1)) for leg in model.legs]
        strain = body.press(float(mu), legs).steps[-1].gauges["g36"] + random.normal(0.0, found.noise)
        (answer,) = estimate(found, strain)
        hits += any(c.low <= mu <= c.high for c in answer.candidates)
    wanted = math.erf(1.0 / math.sqrt(2.0))
    # three binomial standard deviations; the interpolation error, which is no random one here, can only widen the set
    three = 3.0 * math.sqrt(wanted * (1.0 - wanted) / count)
    assert wanted - three <= hits / count <= wanted + three + 0.1


# --- maps ------------------------------------------------------------------------------------------------------------
