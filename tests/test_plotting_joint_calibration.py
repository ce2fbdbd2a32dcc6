"""calibration.png of several readings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.plotting.joint_calibration import draw_joint
from tests.sensor_cases import curve, line, together, tolerance


def test_the_picture_shows_each_reading_alone_and_all_together(tmp_path: Path, figures: list[Any]) -> None:
    shared = (tolerance("depth_mm", 0.1, 1e-3),)
    joint = together(curve(line(1.0), tolerances=shared), curve(line(-2.0), tolerances=shared))
    draw_joint(tmp_path / "a.png", joint)
    ((left, middle, right),) = (figure.axes for figure in figures)
    drawn = {one.get_label(): np.asarray(one.get_ydata()) for one in middle.get_lines()}
    assert drawn["all together"] == pytest.approx(joint.mu_sd(joint.grid))
    assert (drawn["all together"] <= np.minimum(drawn["a alone"], drawn["b alone"]) * (1.0 + 1e-9)).all()
    # each begins at zero, in units of its own error
    first = [one.get_ydata()[0] for one in left.get_lines() if one.get_label() in ("a", "b")]
    assert first == pytest.approx([0.0, 0.0], abs=1e-9)
    names = [text.get_text() for text in right.get_legend().get_texts()]
    assert any(name.startswith("depth_mm ± 0.1") for name in names)
