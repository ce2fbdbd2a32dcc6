"""The page of a design search."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from finger3d.report.optimise import optimise_page
from tests.scenes import words
from tests.sensor_cases import scene


def written(folder: Path, best: float) -> Path:
    """Files of a search with three designs, one of which failed."""
    found = {
        "objective": "sensitivity", "best": 42.5, "start": 30.0, "bodies": 1, "values": {"gauge.g36.x_mm": best},
        "start_values": {"gauge.g36.x_mm": 20.0}, "increments": {"steps": [8], "strain_error": 1.2e-6},
    }  # fmt: skip
    search = {"free": [["gauge.g36.x_mm", 10.0, 40.0]], "scene": scene().as_dict()}
    (folder / "design.json").write_text(json.dumps(found), encoding="utf-8")
    (folder / "search.json").write_text(json.dumps(search), encoding="utf-8")
    rows = f"gauge.g36.x_mm,objective,outcome\n20.0,30.0,converged\n35.0,nan,too deep\n{best},42.5,converged\n"
    (folder / "evaluations.csv").write_text(rows, encoding="utf-8")
    (folder / "best.toml").write_text("x_mm = 1\n", encoding="utf-8")
    return folder


def test_the_best_designs_come_first_and_failures_are_counted(tmp_path: Path) -> None:
    text = words(optimise_page(written(tmp_path, 25.0)))
    assert "(sensitivity) 42.5" in text
    assert {"1 of 3", "2 of 3"} <= set(re.findall(r"\d of \d", text))
    assert "gauge.g36.x_mm 10 40 20 25" in text
    assert text.index("25 42.5") < text.index("20 30 ")
    assert "8 increments 1.2e-06" in text


@pytest.mark.parametrize(("best", "said"), [(25.0, False), (39.9, True), (10.1, True)])
def test_a_value_at_its_bound_is_pointed_out(best: float, said: bool, tmp_path: Path) -> None:
    page = optimise_page(written(tmp_path, best)).read_text(encoding="utf-8")
    remark = re.search(r"<tr><td[^>]*>gauge\.g36\.x_mm</td>.*?<td[^>]*>([^<]*)</td></tr>", page)  # the last cell
    assert remark is not None
    assert ("bound" in remark[1]) == said
