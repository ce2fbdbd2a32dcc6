"""Sketches of the theory: the script draws the committed ones, and each page opens with one, and in words."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
from PIL import Image


def test_the_script_draws_the_sketches_that_open_the_pages(root: Path, tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("sketches", root / "docs" / "_sketches.py")
    assert spec
    assert spec.loader
    sketches = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sketches)
    sketches.draw(tmp_path)
    theory = root / "docs" / "theory"
    names = {path.stem for path in tmp_path.iterdir()}
    assert names == {path.stem for path in theory.glob("*.png")}
    assert names == {path.stem for path in theory.glob("*.md")} - {"index", "solutions"}
    for name in names:
        drawn, kept = (np.asarray(Image.open(folder / f"{name}.png"), dtype=float) for folder in (tmp_path, theory))
        assert drawn.shape == kept.shape
        assert np.abs(drawn - kept).mean() < 1.0
        opening = (theory / f"{name}.md").read_text(encoding="utf-8").split("$")[0]
        assert f"]({name}.png)\n\n" in opening
        assert len(opening.split()) > 40
