"""design.png, and map.png of several gauges."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.plotting.optimise import GaugeMap, draw, draw_places
from tests.designs import FIG9


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


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_map_for_each_gauge_and_the_standard_deviations(count: int, tmp_path: Path, figures: list[Any]) -> None:
    rng, mus = np.random.default_rng(0), (0.2, 0.5, 1.0)
    places = np.column_stack([rng.uniform(-50.0, 50.0, 30), rng.uniform(0.0, 40.0, 30), np.zeros(30)])
    maps = [
        GaugeMap(10.0 * i, 20.0, 0.5, np.array([0.1, 0.2, 0.3]) * (i + 1), places, rng.uniform(0.05, 0.5, 30))
        for i in range(count)
    ]
    together = np.array([0.08, 0.1, 0.12])
    draw_places(tmp_path / "map.png", mus, together, maps, FIG9)
    (figure,) = figures
    panels = [axes for axes in figure.axes if axes.get_xlabel() == "x (mm)"]
    assert len(panels) == count
    for one, axes in zip(maps, panels, strict=True):
        assert np.asarray(axes.collections[0].get_array()) == pytest.approx(one.mean_mu_sd)
        outline = axes.get_lines()[0].get_xydata()
        # the section ends 36.6 mm above its base and is highest in the middle
        assert outline[:, 1].max() == pytest.approx(FIG9.height_mm, abs=0.01)
        assert {text.get_text() for text in axes.texts} == {f"g{k + 1}" for k in range(count)}
    (last,) = (axes for axes in figure.axes if axes.get_yscale() == "log")
    drawn = {one.get_label(): one.get_ydata() for one in last.get_lines()}
    assert ("together" in drawn) == (count > 1)
    assert [*drawn["g1 alone"]] == [0.1, 0.2, 0.3]
