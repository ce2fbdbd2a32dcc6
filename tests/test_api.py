"""The Python interface: what press returns, and every example of the public docstrings run as a reader would."""

from __future__ import annotations

import csv
import doctest
import importlib
import json
from pathlib import Path

import numpy as np
import pytest

import finger3d
from finger3d.errors import Finger3dError
from finger3d.result import PressResult, grid
from tests.test_page import SECTION, SOLID

EXAMPLES = ("finger3d", "finger3d.job", "finger3d.result", "finger3d.page.build", "finger3d.page.states")


@pytest.fixture(scope="module")
def solid(tmp_path_factory: pytest.TempPathFactory) -> PressResult:
    folder = tmp_path_factory.mktemp("api")
    (folder / "scene.toml").write_text(SOLID, encoding="utf-8")
    return finger3d.press(folder / "scene.toml", folder / "out", figures=False, error=False)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_of_the_docstrings_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scene.toml").write_text(SECTION, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    done = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert done.attempted > 0
    assert done.failed == 0


def test_tables_are_those_of_the_files(solid: PressResult) -> None:
    for name, table in {"history.csv": "history", "contact.csv": "contact"}.items():
        with (solid.out / name).open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
        frame = solid.to_dataframe(table)
        assert list(frame.columns) == list(rows[0])
        assert [str(v) for v in frame.iloc[-1]] == list(rows[-1].values())
        assert len(frame) == len(rows)
    with pytest.raises(Finger3dError, match="history"):
        solid.to_dataframe("forces")


def test_the_summary_is_that_of_the_file(solid: PressResult) -> None:
    file = json.loads((solid.out / "summary.json").read_text(encoding="utf-8"))
    assert file["steps"] == json.loads(json.dumps(solid.summary()["steps"]))


def test_fields_of_the_end_and_of_every_kept_step(solid: PressResult) -> None:
    end = solid.to_pyvista()
    assert {"displacement", "strain", "stress", "pressure", "status"} <= set(end.point_data)
    assert np.allclose(solid.to_pyvista(step=4)["displacement"], end["displacement"], atol=1e-6)
    first = solid.to_pyvista(step=1)
    assert set(first.point_data) == {"displacement", "pressure", "shear_x", "shear_z", "status"}
    # the top comes down with the plane: 1/4 of 0.5 mm, up to the weighting of the gap over a facet, h^2 / 8 R, twice
    top = np.argmax(end.points[:, 1])
    assert first["displacement"][top, 1] == pytest.approx(-0.125, abs=2 * 0.5**2 / (8 * 5.0))
    with pytest.raises(Finger3dError, match="step 9 is not among those kept, 1, 2, 3, 4"):
        solid.to_pyvista(step=9)
    with pytest.raises(Finger3dError, match=r"holds no fields\.vtu"):
        grid(solid.out / "nothing")


def test_a_notebook_shows_numbers_and_the_picture(solid: PressResult, tmp_path: Path) -> None:
    html = solid._repr_html_()
    force = solid.summary()["steps"][-1]["normal_force_N"]
    assert f"<td>normal force</td><td>{force:.5g} N</td>" in html
    assert "<script>" not in html  # of the scene's title
    picture = solid.plot_contact()
    assert picture._repr_png_().startswith(b"\x89PNG")
    picture.save(tmp_path / "new" / "contact.png")
    assert (tmp_path / "new" / "contact.png").stat().st_size > 10_000


def test_without_a_folder_the_files_go_with_the_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = finger3d.press(finger3d.load(_written(tmp_path)), error=False)
    out = result.out
    assert (out / "summary.json").exists()
    assert not (out / "report.html").exists()  # no pictures that nobody will see
    assert result.to_pyvista()["displacement"].shape[1] == 3
    assert result.to_pyvista(step=2)["displacement"].shape[1] == 3
    del result
    assert not out.exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene.toml"]


def _written(folder: Path) -> Path:
    (folder / "scene.toml").write_text(SECTION, encoding="utf-8")
    return folder / "scene.toml"
