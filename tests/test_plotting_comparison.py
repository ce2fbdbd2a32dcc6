"""compare.png."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.plotting.comparison import draw
from tests.comparison_cases import case

LINE = {"x_mm": [-1.0, 1.0], "pressure_MPa": [0.1, 0.2], "shear_x_MPa": [0.01, -0.01]}


def test_forces_of_solids_are_shown_against_their_width_and_the_rest_relative_to_the_solid(
    tmp_path: Path, figures: list[Any]
) -> None:
    cases = [case("solid", width, force, 0.1) for width, force in ((10.0, 2.0), (20.0, 3.0), (40.0, 3.5))]
    cases += [case("plane strain", 20.0, 3.6, 0.05), case("plane stress", 20.0, 2.4, 0.05)]
    cases = [replace(one, lines={"z = 0": LINE}) for one in cases]
    draw(tmp_path / "a.png", cases, 20.0, "a title")
    (figure,) = figures
    forces, bars, pressure, shear = figure.axes
    (points,) = (one for one in forces.get_lines() if len(one.get_xdata()) == 3 and one.get_linestyle() == "-")
    assert [*points.get_xdata()] == [10.0, 20.0, 40.0]
    assert [*points.get_ydata()] == [2.0, 3.0, 3.5]
    assert forces.get_xscale() == "log"
    heights = np.array([bar.get_height() for bar in bars.patches]).reshape(3, -1)  # solid, plane strain, plane stress
    assert heights[:, 0] == pytest.approx([1.0, 1.2, 0.8])
    assert heights[:, 1:] == pytest.approx(np.ones_like(heights[:, 1:]))
    assert "a title" in figure.get_suptitle()
    for axes, key in ((pressure, "pressure_MPa"), (shear, "shear_x_MPa")):
        drawn = [one for one in axes.get_lines() if one.get_marker() == "."]
        assert [[*one.get_ydata()] for one in drawn] == [LINE[key]] * 3


def test_without_a_solid_there_is_nothing_to_relate_to(tmp_path: Path, figures: list[Any]) -> None:
    section = replace(case("plane strain", 20.0, 3.6), lines={"z = 0": LINE})
    draw(tmp_path / "a.png", [section], 20.0, "sections alone")
    bars = figures[0].axes[1]
    assert not bars.patches
    assert not bars.axison
