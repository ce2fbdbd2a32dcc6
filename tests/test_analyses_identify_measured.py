"""Files of a measured press."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from finger3d.analyses.identify.measured import read_measured
from finger3d.errors import Finger3dError
from tests.identify_cases import PRESS
from tests.scenes import written
from tests.sensor_cases import scene

KNOWN = ("force_z_N", "normal_force_N", "gauge_a")


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    return written(tmp_path, scene(press=PRESS).to_toml())


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("normal_force_N\n1\n", "depth_mm"),
        ("depth_mm\n1\n2\n", "measured"),
        ("depth_mm,normal_force\n1,2\n2,3\n", 'column "normal_force": .*"normal_force_N"'),
        ("depth_mm,force_N\n1,2\n2,3\n", 'column "force_N": did you mean "normal_force_N"[?]'),
        ("depth_mm,stick_ratio_area\n1,2\n2,3\n", 'column "stick_ratio_area": it is none of'),
        ("depth_mm,gauge_a,gauge_a_std\n1,2,0.1\n2,3,1e-160\n", "line 3: gauge_a_std = 1e-160: must be from 1e-12"),
        ("depth_mm,force_z_N,gauge_a_std\n1,2,3\n2,3,4\n", 'column "gauge_a_std" .*"gauge_a"'),
        ("depth_mm,gauge_a\n1,nan\n2,3\n", "line 2: gauge_a = 'nan'"),
        ("depth_mm,gauge_a\n1,2\n3,3\n2,4\n", "line 4: depth_mm = 2: "),
        ("depth_mm,gauge_a\n1,2\n", "1 .*2"),
        ("depth_mm,gauge_a,gauge_a_std\n1,2,0.1\n2,3,0\n", "line 3: gauge_a_std = 0: "),
        ("", "depth_mm"),
        ("0.1,2\n0.2,3\n", "it has no line of names"),
        ("slide_x_mm,gauge_a\n0,2\n3,3\n2,4\n", "line 4: slide_x_mm = 2: .*time_s or step"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "bench.csv"
    path.write_text(text)
    with pytest.raises(Finger3dError) as found:
        read_measured(path, KNOWN)
    assert re.search(told, str(found.value))
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("text", "index", "at", "columns"),
    [
        ("step,time_s,depth_mm,gauge_a\n1,0,1,5\n2,0,2,6\n", "step", [1, 2], {"depth_mm", "gauge_a"}),
        ("time_s,depth_mm,gauge_a\n0,1,5\n0,2,6\n", "depth_mm", [1, 2], {"gauge_a"}),
        ("depth_mm,slide_x_mm,gauge_a\n3,0,5\n3,-1,6\n", "slide_x_mm", [0, -1], {"depth_mm", "gauge_a"}),
        ("slide_z_mm;gauge_a;method;outcome\n0;5;newton;converged\n1;6;;\n", "slide_z_mm", [0, 1], {"gauge_a"}),
    ],
)
def test_the_first_column_that_changes_in_one_direction_locates_the_rows(
    tmp_path: Path, text: str, index: str, at: list[float], columns: set[str]
) -> None:
    path = tmp_path / "bench.csv"
    path.write_text(text)
    found = read_measured(path, (*KNOWN, "depth_mm"))
    assert (found.index, found.at.tolist(), set(found.columns)) == (index, at, columns)
