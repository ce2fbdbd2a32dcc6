"""Optimisation: the files of a search, in which a design that cannot be built has a line, too."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from finger3d.analyses.optimise.run import optimise
from tests.scenes import words

SETS = ["model.domain=plane-strain", "mesh.size_mm=4", "mesh.base_size_mm=16", "press.steps=10"]


def test_a_design_that_cannot_be_built_is_a_line_with_its_reason(root: Path, tmp_path: Path) -> None:
    scene = root / "geometries" / "fig9.toml"
    found = optimise(scene, ["gauge.0.y_mm=40:60"], tmp_path, mus=(0.1, 0.5, 1.0), budget=8, overrides=SETS)
    assert found.keys == ("gauge.0.y_mm",)
    with (tmp_path / "evaluations.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert any("gauge.0.y_mm" in row["outcome"] for row in rows)
    assert found.best.outcome == "converged"
    assert json.loads((tmp_path / "design.json").read_text())["best"] == found.best.value
    page, failed = words(tmp_path / "report.html"), sum(row["outcome"] != "converged" for row in rows)
    assert f"objective (sensitivity) {found.best.value:.5g}" in page
    assert f"gauge.0.y_mm 40 60 {found.start.values[0]:.5g} {found.best.values[0]:.5g}" in page
    assert f"{failed} of {len(rows)} designs" in page
    assert (tmp_path / "design.png").read_bytes().startswith(b"\x89PNG")
