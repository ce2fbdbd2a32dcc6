"""Pictures in validation/figures: every one is drawn by a command, and the pages show pictures that are there."""

from __future__ import annotations

import re
from pathlib import Path

from tests.pictures import share
from validation import _pictures
from validation._runner import kept_parts, studies


def test_every_picture_is_that_of_a_study_or_of_a_scene(root: Path) -> None:
    drawn = {path.stem for path in (root / "validation" / "figures").iterdir()}
    of_studies = {part for study in studies().values() for part in kept_parts(root / "validation", study)}
    assert drawn == {*of_studies, *_pictures.names()}
    assert not of_studies & {*_pictures.names()}


def test_the_gallery_shows_every_scene(root: Path) -> None:
    gallery = (root / "docs" / "gallery.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"\]\(\.\./validation/figures/(\w+)\.png\)", gallery))
    assert shown >= {*_pictures.names()}


def test_a_picture_of_a_scene_has_its_stick_and_its_slip_zone(tmp_path: Path) -> None:
    from finger3d.contact.friction import SLIP, STICK
    from finger3d.plotting.solid import COLOURS

    coarse = ["mesh.size_mm=1.0", "mesh.base_size_mm=4.0", "press.steps=3", "effects.auto=false"]
    _pictures.draw("edge", tmp_path, coarse)
    for status in (STICK, SLIP):
        assert share(tmp_path / "edge.png", COLOURS[status], within=0.15) > 1e-3
