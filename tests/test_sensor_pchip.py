"""Monotone cubic interpolation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from finger3d.sensor.pchip import MonotoneCubic


def test_the_interpolation_is_that_of_scipy() -> None:
    random = np.random.default_rng(0)
    for _ in range(300):
        count = random.integers(2, 9)
        x, y = np.cumsum(random.uniform(0.1, 2.0, count)), random.normal(size=count) * random.choice([0, 1, 1], count)
        at = random.uniform(x[0], x[-1], 20)
        found, wanted = MonotoneCubic.of(x, y), PchipInterpolator(x, y)
        assert found(at) == pytest.approx(wanted(at), rel=1e-12, abs=1e-12)
        assert found(at, 1) == pytest.approx(wanted(at, 1), rel=1e-9, abs=1e-9)
