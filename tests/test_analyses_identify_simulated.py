"""Simulated presses for values of the free keys."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.identify.measured import MeasuredPress
from finger3d.analyses.identify.simulated import Simulation, largest, names_of
from finger3d.analyses.pressed_body import under
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.results.history import table_row
from finger3d.results.journal import Journal
from tests.sensor_cases import SCENE, scene

FREE = (FreeKey("material.E_MPa", 0.5, 2.0), FreeKey("depth_offset_mm", -0.5, 0.5))
ROW = {
    "values": [1.25, 0.0],
    "outcome": "converged",
    "curve": {"depth_mm": [0.0, 5.0, 10.0], "normal_force_N": [0.0, 2.0, 5.0], "gauge_g36": [0.0, 0.01, 0.03]},
}


def simulation(path: Path, *rows: dict) -> Simulation:
    """A simulation whose solutions are known: nothing is pressed."""
    return Simulation(SCENE, None, FREE, Journal(path / "presses.jsonl", list(rows)))


def measured(at: list[float], path: str = "bench.csv") -> MeasuredPress:
    columns = {name: np.zeros(len(at)) for name in ("normal_force_N", "gauge_g36")}
    return MeasuredPress(Path(path), "depth_mm", np.array(at), columns, {}, tuple(range(2, 2 + len(at))))


def test_forces_scale_with_the_modulus_and_strains_do_not(tmp_path: Path) -> None:
    known = simulation(tmp_path, ROW)
    found = known.curve([2.5, 0.3])
    assert [*found["normal_force_N"]] == [0.0, 4.0, 10.0]
    assert [*found["gauge_g36"]] == [0.0, 0.01, 0.03]
    assert known.solved == 1


def test_the_offset_is_added_to_the_measured_depth(tmp_path: Path) -> None:
    known = simulation(tmp_path, ROW)
    found = known.at([1.25, 0.5], measured([4.5, 9.5]))
    assert [*found["normal_force_N"]] == pytest.approx([2.0, 5.0])
    with pytest.raises(Finger3dError, match=r"line 2: depth_mm = 10: with .* 10\.5, .* ends at 10; .* up to 0 only"):
        known.at([1.25, 0.5], measured([10.0]))


def test_a_press_that_failed_is_not_tried_again(tmp_path: Path) -> None:
    known = simulation(tmp_path, {"values": [1.25, 0.0], "outcome": "too deep", "curve": {}})
    with pytest.raises(Finger3dError, match=r"material\.E_MPa = 1\.25.*too deep"):
        known.curve([0.7, 0.1])


def test_names_and_magnitudes() -> None:
    names = names_of(scene().model())
    assert {"depth_mm", "normal_force_N", "time_s", "gauge_g36", "gauge_long"} <= set(names)
    assert "method" not in names
    assert largest({"a": np.array([-3.0, 2.0]), "b": np.array([])}) == {"a": 3.0, "b": 0.0}


def test_increments_end_at_the_measured_rows(tmp_path: Path) -> None:
    """Between its four increments of 2.5 mm the press of the scene has no numbers at these depths."""
    rows, free = measured([1.3, 6.1]), (FreeKey("friction.mu", 0.1, 0.7),)
    found = Simulation(SCENE, None, free, Journal(tmp_path / "presses.jsonl", []), measured=rows).at([0.4], rows)
    body = build(scene(friction={"mu": 0.4}).model())
    legs = (Leg(1.3, steps=1), Leg(6.1, steps=2))  # no longer than 2.5 mm
    for number in range(2):
        *_, last = march(under(body, legs=legs[: number + 1]))
        numbers = table_row(body.points, last)
        for name in rows.columns:
            assert found[name][number] == pytest.approx(numbers[name], rel=1e-9)
