"""The emulator of a press, with a response in place of presses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.identify.emulator import Emulator
from finger3d.analyses.identify.measured import MeasuredPress
from finger3d.analyses.identify.simulated import Simulation
from finger3d.errors import Finger3dError, MissingError
from finger3d.results.journal import Journal
from tests.sensor_cases import SCENE

FREE = (
    FreeKey("friction.mu", 0.02, 1.0),
    FreeKey("material.nu", 0.3, 0.49),
    FreeKey("material.E_MPa", 0.5, 2.0),
    FreeKey("depth_offset_mm", -0.5, 0.5),
)
DEPTHS = np.array([2.0, 4.0, 6.0])


def curve(mu: float, nu: float) -> dict[str, Any]:
    """A force that stiffens with nu, and a strain that ceases to depend on mu."""
    depth = np.linspace(0.0, 7.0, 29)
    stiffness = (1.0 - nu) / (1.0 + nu) / (1.0 - 2.0 * nu)
    return {"depth_mm": depth, "normal_force_N": stiffness * depth**1.5, "gauge_a": 1e-3 * depth * np.tanh(4.0 * mu)}


def emulator(tmp_path: Path, free: tuple[FreeKey, ...] = FREE, fails: Callable[..., bool] | None = None) -> Emulator:
    columns = {name: curve(0.3, 0.4)[name][[8, 16, 24]] for name in ("normal_force_N", "gauge_a")}
    data = MeasuredPress(tmp_path / "bench.csv", "depth_mm", DEPTHS, columns, {}, (2, 3, 4))

    class Known(Simulation):
        def _solve(self, point: tuple[float, ...]) -> dict[str, Any]:
            if fails and fails(*point[:2]):
                return {"values": list(point), "outcome": "it slips", "curve": {}}
            found = {name: v.tolist() for name, v in curve(*point[:2]).items()}
            return {"values": list(point), "outcome": "converged", "curve": found}

    return Emulator(Known(SCENE, None, free, Journal(tmp_path / "presses.jsonl", [])), data)


def test_the_design_has_corners_faces_and_the_middle_and_no_press_for_modulus_and_offset(tmp_path: Path) -> None:
    found = emulator(tmp_path)
    for shares in found.design():
        found.press(shares)
    assert found.pressed == [0, 1]
    assert found.simulation.solved == 2**2 + 2 * 2 + 1


def test_numbers_between_presses_converge_to_those_of_presses(tmp_path: Path) -> None:
    """Modulus, friction, Poisson's ratio and offset at once: presses nearby leave a tenth of the design's error."""
    found = emulator(tmp_path)
    for shares in found.design():
        found.press(shares)
    wanted = np.array([0.6, 0.8, 0.7, 0.3])
    true = found.simulation.at([s.value(x) for s, x in zip(found.free, wanted, strict=True)], found.data)
    errors = []
    for near in (0.0, 0.05):
        if near:
            for shift in near * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]):
                found.press(wanted + [*shift, 0.0, 0.0])
        error = [np.abs(found.columns(wanted)[name] - values).max() / values.max() for name, values in true.items()]
        errors.append(max(error))
    assert errors[1] < 0.1 * errors[0]


def test_shares_whose_nearest_press_failed_count_as_failing(tmp_path: Path) -> None:
    found = emulator(tmp_path, fails=lambda mu, nu: nu > 0.45)
    for shares in found.design():
        found.press(shares)
    found.check()
    assert found.fails(np.array([[0.5, 0.9, 0.5, 0.5], [0.5, 0.2, 0.5, 0.5]])).tolist() == [True, False]
    none = emulator(tmp_path, fails=lambda mu, nu: mu < 2.0)
    for shares in none.design():
        none.press(shares)
    with pytest.raises(MissingError, match="it slips"):
        none.check()
    assert issubclass(MissingError, Finger3dError)
