"""map.png of several gauges."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.plotting.gauge_places import GaugeMap, draw
from tests.designs import FIG9


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_map_for_each_gauge_and_the_standard_deviations(count: int, tmp_path: Path, figures: list[Any]) -> None:
    rng, mus = np.random.default_rng(0), (0.2, 0.5, 1.0)
    places = np.column_stack([rng.uniform(-50.0, 50.0, 30), rng.uniform(0.0, 40.0, 30), np.zeros(30)])
    maps = [
        GaugeMap(10.0 * i, 20.0, 0.5, np.array([0.1, 0.2, 0.3]) * (i + 1), places, rng.uniform(0.05, 0.5, 30))
        for i in range(count)
    ]
    together = np.array([0.08, 0.1, 0.12])
    draw(tmp_path / "map.png", mus, together, maps, FIG9)
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
