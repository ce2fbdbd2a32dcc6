"""A calibration refines its mesh until that matters little, or says what it would cost."""

from __future__ import annotations

import re
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from finger3d._cost import CALIBRATION_S
from finger3d.analyses.calibrate.mesh_choice import SHARE, choose_mesh, mesh_share
from finger3d.analyses.calibrate.run import calibrate
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.quantities import ORDER
from finger3d.meshing import limits
from finger3d.progress import QUIET
from finger3d.scene import load
from finger3d.sensor import Calibration, Tolerance
from tests.logs import Log
from tests.models import fig9
from tests.sensor_cases import FEW, NONE, SCENE, curve, scene, straight

SECTION = replace(fig9(), domain="plane-strain")


class Fake:
    """Calibrates without a press: the mesh leaves an error of 1e-4 at edges of 1 mm, the noise is as large."""

    def __init__(self, fails_below: float = 0.0, error: float = 1e-4) -> None:
        self.sizes: list[float] = []
        self.fails_below, self.error = fails_below, error

    def __call__(self, model: Model) -> tuple[SimpleNamespace, Calibration]:
        size = model.mesh.size_mm
        if size < self.fails_below:
            raise Finger3dError("too large")
        self.sizes.append(size)
        error = np.full(25, self.error * size**ORDER)
        found = curve(straight, noise=1e-4, tolerances=(Tolerance("mesh", "error bar", 1.0, error, 0.0 * error),))
        return SimpleNamespace(model=model), found


def test_the_mesh_is_refined_until_it_makes_less_than_a_tenth_of_the_variance() -> None:
    fake, said = Fake(), Log()
    found = choose_mesh(SECTION, True, fake, said)
    assert mesh_share(found.calibration) <= SHARE
    assert found.note == ""
    assert fake.sizes[0] == SECTION.mesh.size_mm
    assert 2 <= len(fake.sizes) <= 3  # the order of convergence tells how fine
    assert len(said.lines) == len(fake.sizes) - 1
    assert "again" in said.lines[0]


@pytest.mark.parametrize(("automatic", "longest_s"), [(False, 60.0), (True, 0.0)])
def test_a_finer_mesh_that_is_not_made_is_named_with_its_time(automatic: bool, longest_s: float) -> None:
    fake = Fake()
    found = choose_mesh(SECTION, automatic, fake, pytest.fail, longest_s)
    assert fake.sizes == [SECTION.mesh.size_mm]
    assert "mesh.size_mm = 0.6" in found.note
    assert found.note.endswith(" s")


@pytest.mark.parametrize("speed", [1e-6, 1e6])
def test_the_mesh_does_not_depend_on_the_clock(speed: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error that no affordable mesh makes small is followed to the last mesh below the forecast limit."""
    clock = time.perf_counter
    monkeypatch.setattr(time, "perf_counter", lambda: speed * clock())
    fake = Fake(error=1.0)
    found = choose_mesh(SECTION, True, fake, QUIET)
    assert fake.sizes == pytest.approx([2.0, 0.6, 0.18])  # the next edges are 0.054 mm
    assert float(re.findall(r"about (\S+) s", found.note)[0]) > CALIBRATION_S


def test_a_mesh_too_large_for_the_memory_is_named_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "_machine_gb", lambda: 0.1)
    found = choose_mesh(SECTION, True, Fake(), pytest.fail)
    assert re.search(r"mesh.size_mm = 0.6.*this press: forecast .* GB", found.note)


def test_a_mesh_that_cannot_be_made_leaves_the_calibration_before() -> None:
    fake = Fake(fails_below=1.0)
    found = choose_mesh(SECTION, True, fake, QUIET)
    assert fake.sizes == [SECTION.mesh.size_mm]
    assert "large" in found.note
    with pytest.raises(Finger3dError, match="large"):
        choose_mesh(SECTION, True, Fake(fails_below=9.0), pytest.fail)


@pytest.mark.slow
def test_the_mesh_that_was_chosen_is_that_of_the_results(tmp_path: Path) -> None:
    only = {**NONE, "mesh": 1.0}
    chosen = calibrate(scene(mesh={"mesher": "swept"}), "g36", tmp_path / "own", FEW, noise=1e-3, tolerances=only)
    assert chosen.about["mesh"]["size_mm"] < 0.5  # of the first mesh
    assert chosen.about["mesh"]["note"] == ""
    assert mesh_share(chosen) <= SHARE
    assert load(tmp_path / "own" / "scene.toml").mesh.size_mm == chosen.about["mesh"]["size_mm"]
    given = calibrate(scene(), "g36", tmp_path / "given", FEW, tolerances=only)
    assert given.about["mesh"]["size_mm"] == SCENE["mesh"]["size_mm"]
    assert " % " in given.about["mesh"]["note"]
    assert given.about["mesh"]["note"] in (tmp_path / "given" / "report.html").read_text(encoding="utf-8")
