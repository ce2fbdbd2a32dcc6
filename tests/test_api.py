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
    "press", "compare", "cost", "calibrate", "estimate", "identify", "sweep", "optimise", "export", "plan",
    "sensitivity",
)  # fmt: skip


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_of_the_docstrings_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scene.toml").write_text(SECTION, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    done = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert done.attempted > 0
    assert done.failed == 0


def test_every_command_is_a_function_of_a_scene_with_documented_parameters() -> None:
    for name in (*COMMANDS, "place_gauges"):
        function = getattr(finger3d, name)
        parameters = inspect.signature(function).parameters
        for p in parameters:
            assert re.search(rf"^(\w+, )*{p}(, \w+)* :", inspect.getdoc(function) or "", re.M), (name, p)
        if name != "estimate":
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


def test_every_public_name_is_there() -> None:
    for name in finger3d.__all__:
        assert getattr(finger3d, name) is not None
    assert set(finger3d.__all__) <= set(dir(finger3d))


def test_an_unknown_public_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'pres'"):
        _ = finger3d.pres
