"""Exploded views of molds, and pictures of the steps of casting."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from finger3d.plotting.mold import StepPicture, picture, scenery, standing, step_pictures, taken_apart
from tests.bodies import box
from tests.pictures import share

PARTS = {
    "half_a": box(20.0, 10.0, 5.0, (0.0, 5.0, -2.5)),
    "half_b": box(20.0, 10.0, 5.0, (0.0, 5.0, 2.5)),
    "lid": box(20.0, 2.0, 10.0, (0.0, -1.0, 0.0)),
    "sensor": box(8.0, 6.0, 4.0, (0.0, 3.0, 0.0)),
}


def test_parts_are_moved_apart_and_fit_into_the_picture() -> None:
    view = scenery(standing(taken_apart(PARTS)))
    ends = {name: (part.points.min(axis=0), part.points.max(axis=0)) for name, part in view.parts.items()}
    # poured with the lid on top, and the halves apart along z
    assert ends["lid"][0][1] > max(ends[name][1][1] for name in PARTS if name != "lid") - 1e-9
    gap = ends["half_b"][0][2] - ends["half_a"][1][2]
    assert abs(gap) > 5.0
    assert np.allclose(view.parts["sensor"].points, PARTS["sensor"].points * [1.0, -1.0, -1.0])
    seen = np.vstack([view.flat(part.points) for part in view.parts.values()])
    assert (np.abs(seen) <= view.half).all()
    assert np.abs(seen).max(axis=0) == pytest.approx(view.half / 1.08)


def test_every_part_is_seen_in_its_colour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    assert picture(tmp_path / "a.png", PARTS, "a mold", {"lid": "20 x 10 mm"}) == "matplotlib"
    for colour in ("#9db4c8", "#8d8a84"):  # half A and the lid, shaded
        assert share(tmp_path / "a.png", colour, within=0.2) > 0.01


def test_every_step_has_a_picture_of_its_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    pour = {name: part for name, part in PARTS.items() if name != "lid"}
    pictures = [
        StepPicture(tmp_path / "1.png", PARTS, lying=True),
        StepPicture(tmp_path / "2.png", pour),
    ]
    assert step_pictures(pictures) == "matplotlib"
    lid, sensor = "#8d8a84", "#f28e2b"
    assert share(tmp_path / "1.png", lid, within=0.2) > 0.01
    assert share(tmp_path / "2.png", lid, within=0.05) < 0.01
    assert share(tmp_path / "2.png", sensor, within=0.3) > 0.0
