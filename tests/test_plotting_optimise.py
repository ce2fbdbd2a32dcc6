"""design.png."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from finger3d.plotting.optimise import draw


def test_the_best_so_far_never_falls_and_failed_designs_are_left_out(tmp_path: Path, figures: list[Any]) -> None:
    places, values = [[1.0], [2.0], [3.0], [4.0]], [5.0, float("nan"), 7.0, 6.0]
    draw(tmp_path / "a.png", ["gauge.g.x_mm"], places, values, places[0], "sensitivity")
    convergence, key = figures[0].axes[:2]
    designs, best = convergence.get_lines()
    assert [*designs.get_xdata()] == [1, 3, 4]
    assert [*best.get_ydata()] == [5.0, 7.0, 7.0]
    at = {one.get_label(): np.ravel(one.get_xydata()) for one in key.get_lines()}
    assert [*at["best"]] == [3.0, 7.0]
    assert [*at["start"]] == [1.0, 5.0]
    assert key.get_xlabel() == "gauge.g.x_mm"
    assert convergence.get_ylabel() == "sensitivity"
