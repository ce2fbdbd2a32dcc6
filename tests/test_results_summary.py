"""Files of a results folder: what is read from them, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from finger3d.errors import Finger3dError
from finger3d.results.summary import gauges_of, read_json, read_rows, steps_of, title_of
from tests.scenes import SECTION, pressed

FINGER = {"finger": {"geometry": "half_cylinder"}}
GAUGE = {"name": "g", "x_mm": 1.0, "y_mm": 2, "z_mm": 0.0, "angle_deg": 30.0, "length_mm": 1.0}


@pytest.mark.parametrize(("text", "told"), [("", "summary.json"), ("{", "summary.json"), ("[]", "JSON")])
def test_a_damaged_summary_is_refused(text: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text(text)
    with pytest.raises(Finger3dError, match=told) as error:
        read_json(tmp_path / "summary.json")
    assert str(tmp_path / "summary.json") in str(error.value)


def test_a_folder_without_results_is_named(tmp_path: Path) -> None:
    with pytest.raises(Finger3dError, match="summary.json"):
        read_json(tmp_path / "summary.json")


def test_a_missing_table_has_no_rows_and_a_damaged_one_is_refused(tmp_path: Path) -> None:
    assert read_rows(tmp_path / "results.csv") == []
    (tmp_path / "results.csv").write_bytes(b"a,b\n1,\xff\n")
    with pytest.raises(Finger3dError, match="results.csv"):
        read_rows(tmp_path / "results.csv")
    (tmp_path / "results.csv").write_text("a,b\n1,2\n")
    assert read_rows(tmp_path / "results.csv") == [{"a": "1", "b": "2"}]


def test_the_title_is_that_of_the_scene_or_names_finger_and_object() -> None:
    assert title_of(FINGER | {"title": "my finger"}) == "my finger"
    assert title_of(FINGER) == "half_cylinder on a plane"
    assert title_of(FINGER | {"object": {"shape": "wedge"}}) == "half_cylinder on a wedge"


def test_gauges_are_read_in_radians_and_bad_numbers_refused() -> None:
    (gauge,) = gauges_of({"gauge": [GAUGE]})
    assert (gauge.name, gauge.y_mm, gauge.angle) == ("g", 2.0, pytest.approx(math.pi / 6.0))
    assert gauges_of({}) == []
    for bad in (math.nan, "1", None):
        with pytest.raises(ValueError, match=str(bad)):
            gauges_of({"gauge": [GAUGE | {"x_mm": bad}]})


def test_steps_have_the_numbers_of_the_file(tmp_path: Path) -> None:
    folder = pressed(tmp_path, SECTION)
    summary = read_json(folder / "summary.json")
    steps = steps_of(summary)
    assert [step.normal_force_N for step in steps] == [step["normal_force_N"] for step in summary["steps"]]
    assert steps[-1].gauges == summary["steps"][-1]["gauges"]
    with pytest.raises(TypeError):
        steps_of({"steps": [{"depth_mm": 1.0}]})
