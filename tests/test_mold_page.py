"""The page of a mold."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from finger3d.mold.output import write_mold
from finger3d.mold.shell import shell
from finger3d.progress import Progress


@pytest.fixture
def page(molds, tmp_path: Path, monkeypatch):
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")

    def written(name: str) -> str:
        made = molds[name]
        write_mold("a finger", made, shell(made.body.cad, 0.2, "body", 0.4), tmp_path, False, Progress())
        return (tmp_path / "mold.html").read_text(encoding="utf-8")

    return written


def test_every_step_has_its_picture(page, molds, tmp_path: Path) -> None:
    text = page("tongue, screws, plugs")
    titles = re.findall(r"<h2[^>]*>(\d\. [^<]+)<", text) or re.findall(r">(\d\. [A-Z][^<]+)<", text)
    assert [title.split(". ")[1] for title in titles] == [
        "Print the parts", "Prepare the halves", "Thread the strips of the gauges", "Close the halves", "Pour",
        "Open the mold",
    ]  # fmt: skip
    assert len(list(tmp_path.glob("mold_step_*.png"))) == 6
    assert text.count("data:image/png") == 7
    found = molds["tongue, screws, plugs"].bolts
    assert f"{found.number} M3 x {found.length_mm:g}" in text
    assert "4 % of the cavity" in text


def test_every_pour_has_a_step(page) -> None:
    text = page("pours")
    for i, name in enumerate(("skin", "body", "core"), 1):
        assert f"Pour {i} of 3: {name}" in text
    assert "push lid_skin in slowly" in text
