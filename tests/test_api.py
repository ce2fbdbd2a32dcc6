"""The Python interface: what press returns, and every example of the public docstrings run as a reader would."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import finger3d
import finger3d.analyses.press
from tests.scenes import SECTION, written

EXAMPLES = (
    "finger3d",
    "finger3d.analyses.press",
    "finger3d.analyses.result",
    "finger3d.mechanics.march.step_halving",
    "finger3d.mold.export",
    "finger3d.accuracy.error_bars",
    "finger3d.results.states",
)
COMMANDS = (
    "press",
    "compare",
    "cost",
    "calibrate",
    "estimate",
    "identify",
    "sweep",
    "optimise",
    "export",
    "plan",
    "sensitivity",
)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_of_the_docstrings_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scene.toml").write_text(SECTION, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    done = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert done.attempted > 0
    assert done.failed == 0


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_a_function_with_documented_parameters(name: str) -> None:
    function = getattr(finger3d, name)
    parameters = [p for p in inspect.signature(function).parameters if p != "self"]
    assert name in dir(finger3d)
    assert all(re.search(rf"^(\w+, )*{p}(, \w+)* :", inspect.getdoc(function) or "", re.M) for p in parameters)


@pytest.mark.parametrize("name", [name for name in (*COMMANDS, "place_gauges") if name != "estimate"])
def test_every_analysis_takes_a_scene_and_overrides(name: str) -> None:
    parameters = inspect.signature(getattr(finger3d, name)).parameters
    assert next(iter(parameters)) == "scene"
    assert parameters["overrides"].default == ()


def test_a_calibration_is_estimated_from(tmp_path: Path) -> None:
    calibration = finger3d.calibrate(
        written(tmp_path, SECTION), "<g>", tmp_path / "cal", mus=(0.05, 0.15, 0.2, 0.25, 0.4, 0.8), noise=1e-9
    )
    strain = float(np.interp(0.2, calibration.mu, calibration["<g>"].reading))
    for source in (calibration, tmp_path / "cal" / "calibration.json"):
        (found,) = finger3d.estimate(source, strain, tolerances=False)
        assert found.readings == {"<g>": strain}
        assert abs(found.mu - 0.2) <= 0.2 * found.std  # between four values of mu, the curve itself has an error


def test_a_comparison_has_its_cases(tmp_path: Path) -> None:
    found = finger3d.compare(written(tmp_path, SECTION), tmp_path / "out", widths=())
    assert found.outcome.ok
    assert {case.model for case in found.cases} >= {"plane stress", "plane strain"}


def test_a_sweep_presses_every_combination(tmp_path: Path) -> None:
    vary = {"friction.mu": [0.1, 0.3], "model.domain": ["plane-strain", "plane-stress"]}
    found = finger3d.sweep(written(tmp_path, SECTION), vary, tmp_path / "out", ["press.steps=1"], workers=1)
    table = found.to_dataframe()
    assert found.failed == 0
    assert list(table["friction.mu"]) == [0.1, 0.1, 0.3, 0.3]
    assert list(table["model.domain"]) == 2 * ["plane-strain", "plane-stress"]
    assert (table["normal_force_N"] > 0.0).all()


def test_a_search_returns_the_best_design_as_a_scene(tmp_path: Path) -> None:
    free = {"gauge.0.angle_deg": (0.0, 90.0)}
    scene = written(tmp_path, SECTION)
    found = finger3d.optimise(scene, free, tmp_path / "out", mus=(0.1, 0.3), budget=4, overrides=["press.steps=1"])
    assert found.best.value >= found.start.value
    assert 0.0 <= found.best.values[0] <= 90.0
    assert found.scene.tables.gauge[0].angle_deg == pytest.approx(found.best.values[0])


def test_an_export_writes_files_of_the_fingers_volume(tmp_path: Path) -> None:
    done = finger3d.export(written(tmp_path, SECTION), tmp_path / "out")
    assert [file.name for file in done.files] == ["finger.step", "finger.stl"]
    assert done.stl_volume_mm3 == pytest.approx(done.volume_mm3, rel=0.01)


def test_every_public_name_is_there() -> None:
    for name in finger3d.__all__:
        assert getattr(finger3d, name) is not None
    assert set(finger3d.__all__) <= set(dir(finger3d))


def test_an_unknown_public_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'pres'"):
        _ = finger3d.pres
