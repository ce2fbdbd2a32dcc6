"""calibration.png."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.plotting.calibration import draw
from tests.pictures import CURVE


def test_the_picture_shows_what_was_pressed_its_interpolation_and_all_shares(
    tmp_path: Path, figures: list[Any]
) -> None:
    draw(tmp_path / "a.png", replace(CURVE, failed=((0.7, "no convergence"),)))
    ((left, middle, right),) = (figure.axes for figure in figures)
    drawn = [np.asarray(line.get_ydata()) for line in left.get_lines()]
    assert pytest.approx(CURVE.reading, rel=1e-12) in drawn
    assert pytest.approx(CURVE.at(CURVE.grid)) in drawn
    assert [0.7, 0.7] in [[*line.get_xdata()] for line in left.get_lines()]  # where a press failed
    assert middle.get_yscale() == "log"
    shares = right.collections
    assert len(shares) == len(right.get_legend().get_texts())
    # stacked to one, but for those that are less than half a percent everywhere
    omitted = 2 + len(CURVE.tolerances) - len(shares)
    top = max(path.vertices[:, 1].max() for one in shares for path in one.get_paths())
    assert 1.0 - 0.005 * omitted <= top <= 1.0 + 1e-12
