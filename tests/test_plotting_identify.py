"""identify.png."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.plotting.identify import Panel, draw


def test_residuals_are_shown_in_standard_deviations(tmp_path: Path, figures: list[Any]) -> None:
    at, curve_at = np.array([0.2, 0.5, 0.9]), np.linspace(0.0, 1.0, 5)
    measured = 3.0 * at + [0.1, -0.2, 0.0]
    panels = [
        Panel("normal_force_N", measured, np.full(3, 0.1), 3.0 * at, 3.0 * curve_at),
        Panel("gauge_g", -at, np.full(3, 0.02), -at, -curve_at),
    ]
    draw(tmp_path / "a.png", "depth_mm", at, curve_at, panels)
    (figure,) = figures
    force, gauge, last = figure.axes[:3]
    assert (force.get_ylabel(), gauge.get_ylabel()) == ("normal_force_N", "gauge_g")
    simulated = next(one for one in force.get_lines() if one.get_label() == "simulated")
    assert simulated.get_ydata() == pytest.approx(3.0 * simulated.get_xdata())
    residuals = {one.get_label(): one.get_ydata() for one in last.get_lines()}
    assert residuals["normal_force_N"] == pytest.approx([1.0, -2.0, 0.0], abs=1e-9)
    assert residuals["gauge_g"] == pytest.approx(np.zeros(3), abs=1e-12)
