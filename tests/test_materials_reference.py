"""The table of silicones in docs/materials.md."""

from __future__ import annotations

import runpy
from pathlib import Path

from finger3d.materials.reference import reference
from finger3d.materials.silicones import silicones, sources


def test_the_page_has_the_table(root: Path) -> None:
    assert runpy.run_path(str(root / "docs" / "_quoted.py"))["parts"]("docs/materials.md")[1] == reference()


def test_a_row_for_every_silicone_and_a_number_for_every_source() -> None:
    lines = reference().splitlines()
    rows = [line for line in lines if line.startswith("|")][2:]
    assert [row.split(" | ")[0].removeprefix("| ") for row in rows] == list(silicones())
    assert [line.split(". ")[0] for line in lines if line[:1].isdigit()] == [str(i + 1) for i in range(len(sources()))]
    row = next(r for r in rows if r.startswith("| Dragon Skin 20 "))
    assert "| 0.423 | 25 % | 49 |" in row
