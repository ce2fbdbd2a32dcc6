"""Pictures of the steps of casting."""

from __future__ import annotations

from pathlib import Path

import pytest

from finger3d.plotting.mold_steps import StepPicture, step_pictures
from tests.pictures import share
from tests.test_plotting_mold import PARTS


def test_every_step_has_a_picture_of_its_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    pour = {name: part for name, part in PARTS.items() if name != "lid"}
    pictures = [
        StepPicture(tmp_path / "1.png", PARTS, on_bed=True),
        StepPicture(tmp_path / "2.png", pour),
    ]
    assert step_pictures(pictures) == "matplotlib"
    lid, sensor = "#8d8a84", "#f28e2b"
    assert share(tmp_path / "1.png", lid, within=0.2) > 0.01
    assert share(tmp_path / "2.png", lid, within=0.05) < 0.01
    assert share(tmp_path / "2.png", sensor, within=0.3) > 0.0
