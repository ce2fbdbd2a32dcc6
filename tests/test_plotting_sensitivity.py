"""Figure of effects: a panel for each number, its keys in the order of the table, small ones left out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from finger3d.plotting import sensitivity
from finger3d.plotting.layout import Sheet


def test_each_number_has_a_panel_with_its_keys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []
    save = Sheet.save
    monkeypatch.setattr(Sheet, "save", lambda sheet, path: (made.append(sheet), save(sheet, path)))
    effects = {"press.depth_mm": 2.0, "friction.mu": -1.0, "material.nu": 1e-6}
    table = [
        {
            "number": number,
            "key": key,
            "change": 0.1,
            "falling": -effect,
            "falling_error": 0.1,
            "growing": effect,
            "growing_error": 0.1,
        }
        for number in ("gauge_a", "normal_force_N")
        for key, effect in effects.items()
    ]
    sensitivity.draw(tmp_path / "s.png", "a scene", {"gauge_a": 0.01, "normal_force_N": 3.0}, table)
    (sheet,) = made
    assert len(sheet.axes) == 2
    for axes in sheet.axes:
        labels = [label.get_text() for label in axes.get_yticklabels()]
        assert [text.split(" by ")[0] for text in labels] == ["press.depth_mm", "friction.mu"]
        assert [bar.get_width() for bar in axes.patches] == [-2.0, 1.0, 2.0, -1.0]
