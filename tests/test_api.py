"""The Python interface: what press returns, and every example of the public docstrings run as a reader would."""

from __future__ import annotations

import csv
import doctest
import importlib
import inspect
import json
import re
import subprocess
import sys
from dataclasses import asdict
from html import escape
from pathlib import Path

import numpy as np
import pytest

import finger3d
import finger3d.analyses.press
from finger3d.analyses.result import PressResult
from finger3d.errors import Finger3dError
from finger3d.results.vtu import grid
from tests.scenes import SECTION, SOLID

EXAMPLES = (
    "finger3d",
    "finger3d.analyses.press",
    "finger3d.analyses.result",
    "finger3d.mechanics.step_halving",
    "finger3d.mold.export",
    "finger3d.results.format",
    "finger3d.results.states",
)


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
    from finger3d.analyses.compare.run import Comparison
    from finger3d.mechanics.build import build
    from finger3d.results.comparison import Case
    from finger3d.sensor.curve import Calibration

    scene = finger3d.load(_written(tmp_path))
    mu = np.linspace(0.1, 1.0, 5)
    good = Case(
        "solid", 2.0, 0.5, "swept", finger3d.Outcome.CONVERGED, {"force_N_per_mm": 1.5}, {"force_N_per_mm": 0.1}
    )
    failed = Case("plane <b>", 2.0, 0.5, "swept", finger3d.Outcome.NO_CONVERGENCE)
    shown = {
        "Scene": scene,
        "Calibration": Calibration("<g>", mu, 0.01 * mu, 1e-4, 0.1),
        "Comparison": Comparison((good, failed), ("2D would do",), tmp_path),
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
        "Calibration": ("Gauge &lt;g&gt;", "second-order fit", "usable from mu"),
        "Comparison": ("1.50 ± 0.10", "plane &lt;b&gt;", escape(str(finger3d.Outcome.NO_CONVERGENCE)), "2D would do"),
    }
    for name, texts in parts.items():
        html = shown[name]._repr_html_()  # type: ignore[attr-defined]
        assert all(text in html for text in texts), (name, html)
    assert "1 remark<" in card("t", "s", folded=["<a>"])
    assert "&lt;a&gt;" in card("t", "s", folded=["<a>"])


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


COMMANDS = ("press", "compare", "calibrate", "estimate", "identify", "sweep", "optimise", "export", "plan", "validate")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_a_function_with_documented_parameters(name: str) -> None:
    function = getattr(finger3d, name)
    parameters = [p for p in inspect.signature(function).parameters if p != "self"]
    assert name in dir(finger3d)
    assert all(re.search(rf"^(\w+, )*{p}(, \w+)* :", inspect.getdoc(function) or "", re.M) for p in parameters)


def test_the_import_is_quick_and_loads_neither_cad_nor_a_renderer() -> None:
    code = "import finger3d, sys; print({'OCP', 'vtkmodules', 'matplotlib', 'scipy', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_steps_have_typed_numbers_that_are_those_of_the_summary(solid: PressResult) -> None:
    assert [asdict(step) for step in solid.steps] == [
        {**step, "gauges": dict(step["gauges"])} for step in solid.summary()["steps"]
    ]
    assert solid.last == solid.steps[-1]
    assert solid.last.normal_force_N > solid.last.friction_sum_N > 0.0


def test_a_plan_forecasts_size_time_and_memory(tmp_path: Path) -> None:
    plan = finger3d.plan(_written(tmp_path))
    assert plan.dofs > plan.contact_points > 0
    assert plan.total_s > 0.0
    assert plan.memory_MB > 0.0
    assert plan.summary()["forecast"]["dofs"] == plan.dofs


def test_a_calibration_is_estimated_from(tmp_path: Path) -> None:
    calibration = finger3d.calibrate(_written(tmp_path), "<g>", tmp_path / "cal", mus=(0.05, 0.2, 0.4, 0.8), noise=1e-9)
    strain = float(np.interp(0.2, calibration.mu, calibration.reading))
    for source in (calibration, tmp_path / "cal" / "calibration.json"):
        (found,) = finger3d.estimate(source, strain, tolerances=False)
        assert found.strain == strain
        assert found.mu == pytest.approx(0.2, abs=1e-3)


def test_a_comparison_has_its_cases(tmp_path: Path) -> None:
    found = finger3d.compare(_written(tmp_path), tmp_path / "out", widths=())
    assert found.outcome.ok
    assert {case.model for case in found.cases} >= {"plane stress", "plane strain"}


def test_a_sweep_presses_every_combination(tmp_path: Path) -> None:
    vary = {"friction.mu": [0.1, 0.3], "model.domain": ["plane-strain", "plane-stress"]}
    found = finger3d.sweep(_written(tmp_path), vary, tmp_path / "out", ["press.steps=1"], workers=1)
    table = found.to_dataframe()
    assert found.failed == 0
    assert list(table["friction.mu"]) == [0.1, 0.1, 0.3, 0.3]
    assert list(table["model.domain"]) == 2 * ["plane-strain", "plane-stress"]
    assert (table["normal_force_N"] > 0.0).all()


def test_a_search_returns_the_best_design_as_a_scene(tmp_path: Path) -> None:
    free = {"gauge.0.angle_deg": (0.0, 90.0)}
    scene = _written(tmp_path)
    found = finger3d.optimise(scene, free, tmp_path / "out", mus=(0.1, 0.3), budget=4, overrides=["press.steps=1"])
    assert found.best.value >= found.start.value
    assert 0.0 <= found.best.values[0] <= 90.0
    assert found.scene.tables.gauge[0].angle_deg == pytest.approx(found.best.values[0])


def test_an_export_writes_files_of_the_fingers_volume(tmp_path: Path) -> None:
    done = finger3d.export(_written(tmp_path), tmp_path / "out")
    assert [file.name for file in done.files] == ["finger.step", "finger.stl"]
    assert done.stl_volume_mm3 == pytest.approx(done.volume_mm3, rel=0.01)


def test_a_study_is_validated(tmp_path: Path) -> None:
    found = finger3d.validate(["patch_test"], quick=True, out=tmp_path)
    assert all(row.passed for row in found["patch_test"])


def _written(folder: Path) -> Path:
    (folder / "scene.toml").write_text(SECTION, encoding="utf-8")
    return folder / "scene.toml"


def test_every_public_name_is_there() -> None:
    for name in finger3d.__all__:
        assert getattr(finger3d, name) is not None
    assert set(finger3d.__all__) <= set(dir(finger3d))


def test_an_unknown_public_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'pres'"):
        _ = finger3d.pres
