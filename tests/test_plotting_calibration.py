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
    lines = {line.get_label(): line for line in left.get_lines()}
    assert np.array_equal(lines["pressed"].get_ydata(), CURVE.reading)
    assert lines["monotone interpolation"].get_ydata() == pytest.approx(CURVE.at(CURVE.grid))
    assert [*lines["did not converge"].get_xdata()] == [0.7, 0.7]
    assert middle.get_yscale() == "log"
    shares = right.collections
    assert len(shares) == len(right.get_legend().get_texts())
    # stacked to one, but for those that are less than half a percent everywhere
    omitted = 2 + len(CURVE.tolerances) - len(shares)
    top = max(path.vertices[:, 1].max() for one in shares for path in one.get_paths())
    assert 1.0 - 0.005 * omitted <= top <= 1.0 + 1e-12
