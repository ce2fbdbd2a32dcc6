"""Figure of what accuracy costs: a line for each number, in the order of the time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from finger3d.plotting import cost
from finger3d.plotting.layout import Sheet


def test_each_number_has_a_line_in_the_order_of_the_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []
    save = Sheet.save
    monkeypatch.setattr(Sheet, "save", lambda sheet, path: (made.append(sheet), save(sheet, path)))
    errors = {"normal_force_N": [0.01, 0.1, 0.03], "gauge_g": [0.02, 0.2, 0.06]}
    cost.draw(tmp_path / "cost.png", "a scene", [9.0, 1.0, 3.0], errors, 3.0)
    (axes,) = made[0].axes
    lines = {line.get_label(): line for line in axes.lines}
    assert list(lines["gauge_g"].get_xdata()) == [1.0, 3.0, 9.0]
    assert list(lines["gauge_g"].get_ydata()) == pytest.approx([20.0, 6.0, 2.0])
    assert set(lines["this mesh"].get_xdata()) == {3.0}
    assert (tmp_path / "cost.png").stat().st_size > 5000
