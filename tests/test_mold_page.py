"""The page of a mold."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path

import pytest

from finger3d.mold.packing import as_printed, beds
from finger3d.mold.page import mold_page
from finger3d.mold.parts import Mold
from finger3d.mold.steps import pour_lines


def write(made: Mold, out: Path) -> str:
    shells = {name: made.shell(name, 0.5, 0.8) for name in made.parts}
    printed = as_printed(shells)
    packed = beds(printed, made.options.bed_mm)
    mold_page("a finger", made, shells, printed, packed, out, "the sheet", ["a remark"])
    return (out / "mold.html").read_text(encoding="utf-8")


def test_every_step_has_its_picture(molds, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    made = molds["tongue, screws, plugs"]
    text = write(made, tmp_path)
    assert re.findall(r"<h2>(\d)\. [A-Z]", text) == ["1", "2", "3", "4", "5", "6"]
    words = ("print", "prepare", "gauges", "close", "pour", "open")
    pictures = [f"mold_step_{i}_{word}.png" for i, word in enumerate(words, 1)]
    assert sorted(path.name for path in tmp_path.glob("mold_step_*.png")) == pictures
    assert text.count("data:image/png") == 6
    assert f"{made.bolts.number} M3 x {made.bolts.length_mm:g}" in text
    assert "<dd>4 % " in text
    assert "a remark" in text
    assert "the sheet" in text


def test_every_pour_has_a_step(molds, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the parts that are in the mold then: the lid of that pour, and all that was cast so far."""
    drawn = {}
    monkeypatch.setattr(
        "finger3d.mold.page.step_pictures", lambda pictures: drawn.update((p.path.stem, set(p.parts)) for p in pictures)
    )
    made = molds["pours"]
    text = write(made, tmp_path)
    for i, name in enumerate(("skin", "body", "core"), 1):
        assert f"Pour {i} of 3: {name}" in text
        (parts,) = (parts for stem, parts in drawn.items() if stem.endswith(f"pour_{name}"))
        assert f"lid_{name}" in parts
        assert sum(part.startswith("silicone") for part in parts) == i
    assert all(escape(line) in text for pour in made.pours for line in pour_lines(made, pour))
