"""The picture of a sweep."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from finger3d.errors import Finger3dError
from finger3d.report.sweep_figure import picture

ROWS = (
    "friction.mu,press.depth_mm,normal_force_N,outcome\n0.1,5,1.0,converged\n0.3,5,2.0,converged\n0.1,8,3.0,converged\n"
)


def folder_with(path: Path, rows: str, keys: list[str]) -> Path:
    (path / "sweep.json").write_text(json.dumps({"scene": {}, "vary": {key: [] for key in keys}}), encoding="utf-8")
    (path / "results.csv").write_text(rows, encoding="utf-8")
    return path


def test_a_panel_for_each_varied_key_with_the_lines_of_its_chart(tmp_path: Path, figures: list[Any]) -> None:
    folder = folder_with(tmp_path, ROWS, ["friction.mu", "press.depth_mm"])
    picture(folder, tmp_path / "a.png")
    mu, depth = figures[0].axes
    assert (mu.get_xlabel(), depth.get_xlabel()) == ("friction.mu", "press.depth_mm")
    lines = {one.get_label(): one for one in mu.get_lines()}
    assert [*lines["5"].get_xdata()] == [0.1, 0.3]
    assert [*lines["5"].get_ydata()] == [1.0, 2.0]


@pytest.mark.parametrize(
    ("rows", "told"),
    [("friction.mu,outcome\n0.1,converged\n", "draw"),
     (ROWS.replace("0.3", "0.1"), "draw"), ("a;b\n1;2\n", "sweep")],
)  # fmt: skip
def test_what_cannot_be_drawn_is_one_line(rows: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(Finger3dError, match=told):
        picture(folder_with(tmp_path, rows, ["friction.mu"]), tmp_path / "a.png")
    assert not (tmp_path / "a.png").exists()
