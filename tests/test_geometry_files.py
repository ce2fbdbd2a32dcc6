"""Files with bodies."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.files import read_surface, welded
from finger3d.geometry.imported import imported
from finger3d.geometry.surface_checks import mistake
from tests.bodies import box

DRAWN: list[Path] = []


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda p: (p / "a.stl").write_text("hello"), "a.stl: .*STL"),
        (lambda p: (p / "a.stl").write_text(""), "STL"),
        (lambda p: (p / "a.stl").write_bytes(bytes(range(256)) * 10), "STL"),
        (lambda p: (p / "a.stl").write_bytes(b"\0" * 80 + (2**31).to_bytes(4, "little")), "STL"),
        (lambda p: (p / "a.step").write_text("hello"), "a.step: .*STEP"),
        (lambda p: (p / "a.step").write_text(""), "STEP"),
        (lambda p: shutil.copy(DRAWN[0] / "two.step", p / "a.step"), "a.step: .*2 solids"),
        (lambda p: shutil.copy(DRAWN[0] / "face.step", p / "a.step"), "solid"),
        (lambda p: (p / "a.obj").write_text("v 0 0 0"), ".stl, .step or .stp"),
        (lambda p: (p / "a.stl").mkdir(), "a.stl"),
        (lambda p: None, "a.stl"),
    ],
    ids=["text", "empty", "bytes", "header", "step text", "step empty", "two solids", "face", "obj", "folder", "none"],
)
def test_files_that_hold_no_body(drawn: Path, tmp_path: Path, make, text: str) -> None:
    DRAWN[:] = [drawn]
    make(tmp_path)
    path = next(tmp_path.iterdir(), tmp_path / "a.stl")
    for read in (read_surface, imported):
        with pytest.raises(Finger3dError, match=text) as refused:
            read(path)
        assert "\n" not in str(refused.value)


def test_gaps_of_single_precision_are_closed() -> None:
    soup = box(20.0, 10.0, 6.0)
    loose = soup.corners.reshape(-1, 3) + np.random.default_rng(0).uniform(-1e-6, 1e-6, (36, 3))
    joined = welded(loose, np.arange(36).reshape(-1, 3))
    assert len(joined.points) == 8
    assert mistake(joined) == ""
