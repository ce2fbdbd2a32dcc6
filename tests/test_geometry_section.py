"""Sections of fingers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.designs import make


def test_the_papers_finger_is_50_mm_high() -> None:
    # Maeno 2004, Sec. III: 36.6 = 50 - (100 - sqrt(100^2 - 50^2)), to the digits the paper gives.
    assert make("clipped_cylinder").height_mm == pytest.approx(50.0, abs=0.003)


def test_a_clipped_cylinder_without_clipping_is_the_half_cylinder() -> None:
    clipped = make("clipped_cylinder", radius_mm=5.0, half_length_mm=5.0, edge_height_mm=0.0, width_mm=10.0)
    half = make("half_cylinder")
    assert clipped.volume_mm3 == half.volume_mm3 == pytest.approx(0.5 * math.pi * 250.0, rel=1e-15)
    assert clipped.height_mm == half.height_mm
    x, z = np.linspace(-6, 6, 25), np.zeros(25)
    np.testing.assert_array_equal(clipped.top(x, z), half.top(x, z))
