"""calibration.png."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.plotting.calibration import draw
from tests.pictures import CURVE
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
