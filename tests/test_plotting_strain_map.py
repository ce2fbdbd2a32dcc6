"""map.png of a calibration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.mechanics.model import Gauge
from finger3d.plotting.strain_map import draw_map
from finger3d.sensor.maps import StrainMap
from tests.pictures import CURVE, MUS


def test_slopes_and_resolutions_of_a_strain_along_x(tmp_path: Path, figures: list[Any]) -> None:
    """Strain along x is 1e-3 mu, none along y: a gauge along x resolves noise / 1e-3, one along y nothing."""
    x, y = np.linspace(-50.0, 50.0, 11), np.linspace(0.0, 50.0, 6)
    strain = np.zeros((len(MUS), len(y), len(x), 3))
    strain[..., 0] = 1e-3 * MUS[:, None, None]
    found = StrainMap(MUS, x, y, 0.0, strain)
    draw_map(tmp_path / "a.png", found, Gauge("g36", 36.0, 40.0), CURVE)
    slope, along, best = figures[0].axes[:3]
    assert np.asarray(slope.collections[0].get_array()) == pytest.approx(np.full((6, 11), 1e-3), rel=1e-6)
    for axes in (along, best):
        shown = np.ma.filled(axes.collections[1].get_array(), np.nan)
        assert shown == pytest.approx(np.full((6, 11), CURVE.noise[0] / 1e-3), rel=1e-3)
        assert [*axes.get_lines()[-1].get_xydata()[0]] == [36.0, 40.0]
    arrows = best.collections[-1]
    assert np.abs(arrows.V) == pytest.approx(np.zeros(len(arrows.V)), abs=1e-2)
    draw_map(tmp_path / "b.png", found, Gauge("across", 0.0, 25.0, angle=0.5 * np.pi), CURVE)
    assert np.ma.getmaskarray(figures[1].axes[1].collections[1].get_array()).all()
