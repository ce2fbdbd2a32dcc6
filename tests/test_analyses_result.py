"""The result of a press: numbers, tables, fields, and how a notebook shows it."""

from __future__ import annotations

import csv
import re
import shutil
from collections.abc import Callable
from html import escape
from pathlib import Path

import numpy as np
import pytest

import finger3d
import finger3d.analyses.press
from finger3d.analyses.result import PressResult
from finger3d.errors import Finger3dError
from finger3d.results.states import grid
from tests.scenes import SECTION, SOLID, written


@pytest.fixture(scope="module")
def solid(tmp_path_factory: pytest.TempPathFactory) -> PressResult:
    folder = tmp_path_factory.mktemp("api")
    (folder / "scene.toml").write_text(SOLID, encoding="utf-8")
    return finger3d.press(folder / "scene.toml", folder / "out", figures=False, error=False)


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


def test_fields_of_the_end_and_of_every_kept_step(solid: PressResult) -> None:
    end = solid.to_pyvista()
    assert {"displacement", "strain", "stress", "pressure", "status"} <= set(end.point_data)
    assert np.allclose(solid.to_pyvista(step=4)["displacement"], end["displacement"], atol=1e-6)
    first = solid.to_pyvista(step=1)
    assert set(first.point_data) == {"displacement", "pressure", "shear_x", "shear_z", "status"}
    # the top comes down with the plane: 1/4 of 0.5 mm, up to the weighting of the gap over a facet, h^2 / 8 R, twice
    top = np.argmax(end.points[:, 1])
    assert first["displacement"][top, 1] == pytest.approx(-0.125, abs=2 * 0.5**2 / (8 * 5.0))
    with pytest.raises(Finger3dError, match="increment 9 .* 1, 2, 3, 4"):
        solid.to_pyvista(step=9)
    with pytest.raises(Finger3dError, match=r"fields\.vtu"):
        grid(solid.out / "nothing")


def test_a_notebook_shows_numbers_and_the_picture(solid: PressResult, tmp_path: Path) -> None:
    html = solid._repr_html_()
    force = solid.summary()["steps"][-1]["normal_force_N"]
    assert re.search(rf"<td[^>]*>normal force</td><td[^>]*>{force:.5g} N</td>", html)
    assert "<script>" not in html  # of the scene's title
    assert all(escape(text) in html for text in solid.summary()["advice"])
    assert repr(solid).endswith(f": converged, 4 steps, {force:.5g} N at 0.5 mm>")
    picture = solid.plot_contact()
    assert picture._repr_png_().startswith(b"\x89PNG")
    picture.save(tmp_path / "new" / "contact.png")
    assert (tmp_path / "new" / "contact.png").stat().st_size > 10_000


def test_what_a_notebook_prints_of_the_other_objects_is_short_and_its_html_is_whole(
    solid: PressResult, tmp_path: Path
) -> None:
    from finger3d._notebook import card
    from finger3d.analyses.compare import Comparison
    from finger3d.mechanics.discretise.build import build
    from finger3d.results.summary import Case
    from finger3d.sensor import Calibration, ReadingCurve

    scene = finger3d.load(written(tmp_path, SECTION))
    mu = np.linspace(0.1, 1.0, 5)
    good = Case(
        "solid", 2.0, 0.5, "swept", finger3d.Outcome.CONVERGED, {"force_N_per_mm": 1.5}, {"force_N_per_mm": 0.1}
    )
    failed = Case("plane <b>", 2.0, 0.5, "swept", finger3d.Outcome.NO_CONVERGENCE)
    shown = {
        "Scene": scene,
        "Calibration": Calibration((ReadingCurve("<g>", mu, 0.01 * mu, 1e-4),), 0.1),
        "Comparison": Comparison((good, failed), ("2D would do",), (), tmp_path),
        "ReducedModel": finger3d.ReducedModel.of(build(scene.model())),
        "History": solid.history,
        "Mesh": build(scene.model()).mesh,
    }
    for name, found in shown.items():
        assert repr(found).startswith(f"<{name}")
        assert len(repr(found)) < 250
        assert "\n" not in repr(found)
    parts = {
        "Scene": ("E_MPa = 1.0", "domain = plane-stress", "steps = 4"),
        "Calibration": ("Gauge &lt;g&gt;", "second-order fit", "mu is found to 0.1 or better"),
        "Comparison": ("1.50 ± 0.10", "plane &lt;b&gt;", escape(str(finger3d.Outcome.NO_CONVERGENCE)), "2D would do"),
    }
    for name, texts in parts.items():
        html = shown[name]._repr_html_()  # type: ignore[attr-defined]
        assert all(text in html for text in texts), (name, html)
    assert "1 remark<" in card("t", "s", folded=["<a>"])
    assert "&lt;a&gt;" in card("t", "s", folded=["<a>"])


def test_without_a_folder_the_files_go_with_the_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = finger3d.press(finger3d.load(written(tmp_path, SECTION)), error=False)
    out = result.out
    assert (out / "summary.json").exists()
    assert not (out / "report.html").exists()  # no pictures that nobody will see
    assert result.to_pyvista()["displacement"].shape[1] == 3
    assert result.to_pyvista(step=2)["displacement"].shape[1] == 3
    del result
    assert not out.exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene.toml"]


def test_a_folder_opens_as_the_result_that_was_written_there(solid: PressResult) -> None:
    opened = finger3d.load(str(solid.out))
    assert (repr(opened), opened.outcome, opened.steps) == (repr(solid), solid.outcome, solid.steps)
    assert opened.history is None
    for table in ("history", "contact"):
        assert opened.to_dataframe(table).equals(solid.to_dataframe(table))
    assert np.array_equal(opened.to_pyvista(2)["pressure"], solid.to_pyvista(2)["pressure"])
    assert opened._repr_html_() == solid._repr_html_()
    assert opened.plot_contact() == solid.plot_contact()
    assert opened.plot_forces() == solid.plot_forces()


def test_a_result_keeps_its_tables_when_its_folder_is_used_again(tmp_path: Path) -> None:
    given = finger3d.load(written(tmp_path, SECTION))
    first = finger3d.press(given, tmp_path / "out", figures=False, error=False)
    before = first.to_dataframe("contact")
    finger3d.press(given, tmp_path / "out", figures=False, error=False, overrides=["material.E_MPa=3.0"])
    assert first.to_dataframe("contact").equals(before)


@pytest.mark.parametrize(
    ("name", "edit", "said"),
    [
        ("summary.json", lambda text: text[:-9], "summary.json: cannot be read"),
        ("summary.json", lambda text: text.replace('"depth_mm"', '"deep_mm"'), "summary.json: its steps .*deep_mm"),
        ("history.csv", lambda text: text.replace("0.25,", "a quarter,", 1), "history.csv: is damaged .*a quarter"),
        ("contact.csv", lambda text: text.replace("pressure_MPa", "p", 1), "no column 'pressure_MPa'"),
        ("steps.npz", lambda text: "", "steps.npz: cannot be read"),
    ],
)
def test_a_damaged_folder_is_one_line(name: str, edit: Callable, said: str, solid: PressResult, tmp_path: Path) -> None:
    shutil.copytree(solid.out, tmp_path / "out")
    path = tmp_path / "out" / name
    path.write_text(edit(path.read_text(encoding="utf-8", errors="replace")), encoding="utf-8")
    with pytest.raises(Finger3dError, match=said) as told:
        finger3d.load(tmp_path / "out").plot_contact()
    assert "\n" not in str(told.value)


def test_what_is_no_folder_of_a_press_is_refused(solid: PressResult, tmp_path: Path) -> None:
    with pytest.raises(Finger3dError, match=r"holds no results of a press .no summary.json"):
        finger3d.load(tmp_path)
    with pytest.raises(Finger3dError, match=r"friction.mu=0.5 changes a scene; load .*scene.toml"):
        finger3d.load(solid.out, ["friction.mu=0.5"])
