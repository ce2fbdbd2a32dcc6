"""Readings by name: what an estimate takes, refuses, and reads from files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.sensor import Calibration, estimate, load, save
from tests.sensor_cases import curve, line, opposite, straight, together


@pytest.fixture
def joint() -> Calibration:
    return opposite()


def test_a_single_gauge_may_be_named() -> None:
    one = curve(straight)
    assert estimate(one, {"g": straight(0.3)}, {"g": 1e-3}) == estimate(one, straight(0.3), 1e-3)
    with pytest.raises(Finger3dError, match="h: .* g"):
        estimate(one, {"h": 0.1})


def test_readings_may_be_many(joint: Calibration) -> None:
    mu = np.array([0.2, 0.5, 0.8])
    found = estimate(joint, dict(zip("ab", joint.at(mu).T, strict=True)), {"a": [1e-4, 2e-4, 3e-4]})
    assert [f.mu for f in found] == pytest.approx(list(mu), abs=0.02)
    assert [f.stds["a"] for f in found] == [1e-4, 2e-4, 3e-4]
    assert [f.stds["b"] for f in found] == [1.5e-4] * 3


@pytest.mark.parametrize(
    ("readings", "std", "told"),
    [
        (0.05, None, "a, b"),
        ({}, None, "name"),
        ({"a": 0.05, "x": 0.1}, None, "x: .* a, b"),
        ({"a": float("nan"), "b": 0.05}, None, "a = nan: "),
        ({"a": [0.05, float("inf")], "b": [0.05, 0.05]}, None, r"a = inf \(reading 2 of 2\)"),
        ({"a": [0.05, 0.05], "b": 0.05}, None, "b: 1 .* 2 "),
        ({"a": 0.05, "b": 0.05}, {"a": -1e-4}, "a = -0.0001: "),
        ({"a": 0.05, "b": 0.05}, {"c": 1e-4}, "c: "),
        ({"a": [0.05, 0.05], "b": [0.05, 0.05]}, {"a": [1e-4] * 3}, "a: 3 .* 2 "),
    ],
)
def test_readings_that_are_refused(joint: Calibration, readings: Any, std: Any, told: str) -> None:
    with pytest.raises(Finger3dError, match=told) as found:
        estimate(joint, readings, std)
    assert "\n" not in str(found.value)


def test_one_deviation_for_readings_of_several_units_is_refused() -> None:
    mixed = together(curve(line(0.01)), curve(line(1.0), kind="marker", noise=0.02))
    with pytest.raises(Finger3dError, match="b in mm"):
        estimate(mixed, {"a": 0.05, "b": 0.5}, 1e-4)
    assert estimate(mixed, {"a": 0.055, "b": 0.55}, {"a": 1e-4, "b": 0.01})[0].mu == pytest.approx(0.5, abs=0.02)


def test_a_joint_calibration_is_read_as_it_was_written(tmp_path: Path, joint: Calibration) -> None:
    after = load(save(joint, tmp_path / "calibration.json"))
    assert isinstance(after, Calibration)
    assert after.names == joint.names
    assert np.array_equal(after.covariance([0.4]), joint.covariance([0.4]))
    readings = {"a": 0.055, "b": 0.047}
    assert estimate(tmp_path / "calibration.json", readings) == estimate(joint, readings)
