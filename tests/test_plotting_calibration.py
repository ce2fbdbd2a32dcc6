"""calibration.png and map.png of a calibration."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.mechanics.model import Gauge
from finger3d.plotting.calibration import draw, draw_map
from finger3d.sensor.maps import StrainMap
from tests.pictures import CURVE, MUS
from tests.sensor_cases import curve, line, together, tolerance


def test_the_picture_shows_what_was_pressed_its_interpolation_and_all_causes(
    tmp_path: Path, figures: list[Any]
) -> None:
    draw(tmp_path / "a.png", replace(CURVE, failed=((0.7, "no convergence"),)))
    ((left, middle, right),) = (figure.axes for figure in figures)
    drawn = [np.asarray(line.get_ydata()) for line in left.get_lines()]
    g36 = CURVE["g36"]
    assert pytest.approx(g36.reading, rel=1e-12) in drawn
    assert pytest.approx(g36.at(CURVE.grid)) in drawn
    assert [0.7, 0.7] in [[*line.get_xdata()] for line in left.get_lines()]  # where a press failed
    assert middle.get_yscale() == "log"
    assert {line.get_label() for line in middle.get_lines()} == {"with all tolerances", "noise alone", "limit 0.1"}
    names = [text.get_text().split(" ")[0] for text in right.get_legend().get_texts()]
    assert set(names) == {t.name for t in g36.tolerances}  # the noise makes less than a percent


def test_the_picture_shows_each_reading_alone_and_all_together(tmp_path: Path, figures: list[Any]) -> None:
    shared = (tolerance("depth_mm", 0.1, 1e-3),)
    joint = together(curve(line(1.0), tolerances=shared), curve(line(-2.0), tolerances=shared))
    draw(tmp_path / "a.png", joint)
    ((left, middle, right),) = (figure.axes for figure in figures)
    drawn = {one.get_label(): np.asarray(one.get_ydata()) for one in middle.get_lines()}
    together_sd = drawn["with all tolerances"]
    assert together_sd == pytest.approx([found.std for found in joint.judged], nan_ok=True)
    known = np.isfinite(drawn["a alone"]) & np.isfinite(drawn["b alone"])
    assert known.sum() > 50
    assert (together_sd <= np.minimum(drawn["a alone"], drawn["b alone"]) * 1.01)[known].all()
    # each begins at zero, in units of its own error
    first = [one.get_ydata()[0] for one in left.get_lines() if one.get_label() in ("a", "b")]
    assert first == pytest.approx([0.0, 0.0], abs=1e-9)
    names = [text.get_text() for text in right.get_legend().get_texts()]
    assert any(name.startswith("depth_mm ± 0.1") for name in names)


@pytest.mark.filterwarnings("error::UserWarning")
def test_a_reading_that_never_tells_mu_is_drawn_as_well(tmp_path: Path, figures: list[Any]) -> None:
    draw(tmp_path / "a.png", curve(lambda mu: 0.03 + 0.0 * mu))
    ((_, middle, right),) = (figure.axes for figure in figures)
    assert [one.get_label() for one in middle.get_lines() if np.isfinite(one.get_ydata()).any()] == ["limit 0.1"]
    assert right.get_legend() is None


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
