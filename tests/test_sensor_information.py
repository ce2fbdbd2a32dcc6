"""Fisher information of readings, against the generalised least squares of a joint calibration."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.sensor.information import ReadingEffects, mu_sd, prior
from tests.sensor_cases import curve, line, together, tolerance

NOISE, DEPTH_SD = 1.5e-4, 0.1


def test_the_information_is_that_of_a_joint_calibration() -> None:
    slopes, depths = (0.01, -0.006, 0.002), (0.02, 0.02, -0.03)
    joint = together(
        *(curve(line(s), tolerances=(tolerance("depth_mm", DEPTH_SD, d),)) for s, d in zip(slopes, depths, strict=True))
    )
    effects = ReadingEffects(
        np.array([[[s, DEPTH_SD * d]] for s, d in zip(slopes, depths, strict=True)]), np.full((3, 1), NOISE**2)
    )
    nothing = prior(1, 1e6)  # of mu
    every = mu_sd(nothing + effects.fisher.sum(axis=0))
    assert every[0] == pytest.approx(joint.mu_sd([0.5])[0], rel=1e-6)
    for i, name in enumerate(joint.names):
        assert mu_sd(nothing + effects.fisher[i])[0] == pytest.approx(joint.of([name]).mu_sd([0.5])[0], rel=1e-6)


def test_without_readings_mu_is_known_as_before() -> None:
    assert mu_sd(prior(2, 0.3)) == pytest.approx(0.3)
    assert mu_sd(prior(0, 0.3)) == pytest.approx(0.3)
