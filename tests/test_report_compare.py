"""The page of a comparison."""

from __future__ import annotations

import json
from pathlib import Path

from finger3d.report.compare import compare_page
from finger3d.results.summary import title_of
from tests.scenes import words


def test_a_comparison_tells_its_verdict_and_every_case(tmp_path: Path) -> None:
    force = "force_N_per_mm"
    case = {"size_mm": 2.0, "mesher": "swept", "outcome": "converged", "seconds": 1.0, "lines": {}}
    data = {
        "scene": {"title": "<t>", "finger": {"geometry": "block", "width_mm": 20.0}, "effects": {}},
        "outcome": "converged", "versions": {"finger3d": "1"},
        "verdict": ["Plane strain overstates the force by 74 %."],
        "table": [["", "solid", "plane strain"], ["peak pressure (MPa)", "0.21", "0.34"]],
        "cases": [
            {**case, "model": "solid", "width_mm": 20.0, "numbers": {force: 15.2}, "errors": {force: 0.1}},
            {**case, "model": "plane strain", "width_mm": 20.0, "numbers": {force: 26.4}, "errors": {}},
            {**case, "model": "solid", "width_mm": 99.0, "numbers": {}, "errors": {}, "outcome": "it failed"},
        ],
    }  # fmt: skip
    (tmp_path / "compare.json").write_text(json.dumps(data), encoding="utf-8")
    text = words(compare_page(tmp_path))
    assert "<t>: " in text
    del data["scene"]["title"]
    (tmp_path / "compare.json").write_text(json.dumps(data), encoding="utf-8")
    assert title_of(data["scene"]) in words(compare_page(tmp_path))
    assert "solid 15.20 ± 0.10 N/mm" in text
    assert "plane strain 26.4 N/mm" in text
    assert data["verdict"][0] in text
    assert "peak pressure (MPa) 0.21 0.34" in text
    assert "99 2 1 it failed" in text
