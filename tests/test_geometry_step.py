"""STEP files, which are read in a child process."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.files import read_step, read_surface


def test_a_step_file_that_crashes_the_reader_is_told_in_one_line(drawn: Path, tmp_path: Path) -> None:
    text = (drawn / "finger.step").read_text()
    (tmp_path / "a.step").write_text(re.sub(r"#\d+ = VECTOR\(.*\n", "", text))
    with pytest.raises(Finger3dError, match=r"a.step: OpenCASCADE crashed \(SIGSEGV.*damaged") as refused:
        read_surface(tmp_path / "a.step")
    assert "\n" not in str(refused.value)


def test_solids_of_a_moved_assembly_have_the_names_of_their_products(tmp_path: Path) -> None:
    from build123d import Box, Compound, Pos, export_step

    small, large = Box(2.0, 2.0, 2.0), Pos(0.0, 3.0, 0.0) * Box(4.0, 4.0, 4.0)
    small.label, large.label = "core.a", "skin"
    inner = Compound(label="inner", children=[small, large])
    export_step(Compound(label="outer", children=[inner]).moved(Pos(30.0, 0.0, 0.0)), tmp_path / "a.step")
    read = read_step(tmp_path / "a.step")
    found = {label: solid.volume for label, solid in zip(read.labels, read.solids, strict=True)}
    assert found == pytest.approx({"core_a": 8.0, "skin": 64.0})
