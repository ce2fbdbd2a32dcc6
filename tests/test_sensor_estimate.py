"""Readings by name: what an estimate takes, refuses, and reads from files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.sensor import JointCalibration, estimate, load, save
from tests.sensor_cases import curve, line, opposite, straight, together


@pytest.fixture
def joint() -> JointCalibration:
    return opposite()


def test_a_single_gauge_may_be_named() -> None:
    one = curve(straight)
    assert estimate(one, {"g": straight(0.3)}, {"g": 1e-3}) == estimate(one, straight(0.3), 1e-3)
    with pytest.raises(Finger3dError, match="h: .* g"):
        estimate(one, {"h": 0.1})


def test_readings_may_be_many(joint: JointCalibration) -> None:
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
def test_readings_that_are_refused(joint: JointCalibration, readings: Any, std: Any, told: str) -> None:
    with pytest.raises(Finger3dError, match=told) as found:
        estimate(joint, readings, std)
    assert "\n" not in str(found.value)


def test_one_deviation_for_readings_of_several_units_is_refused() -> None:
    mixed = together(curve(line(0.01)), curve(line(1.0), kind="marker", noise=0.02))
    with pytest.raises(Finger3dError, match="b in mm"):
        estimate(mixed, {"a": 0.05, "b": 0.5}, 1e-4)
    assert estimate(mixed, {"a": 0.055, "b": 0.55}, {"a": 1e-4, "b": 0.01})[0].mu == pytest.approx(0.5, abs=0.02)


def test_a_joint_calibration_is_read_as_it_was_written(tmp_path: Path, joint: JointCalibration) -> None:
    after = load(save(joint, tmp_path / "calibration.json"))
    assert isinstance(after, JointCalibration)
    assert after.names == joint.names
    assert np.array_equal(after.covariance([0.4]), joint.covariance([0.4]))
    readings = {"a": 0.055, "b": 0.047}
    assert estimate(tmp_path / "calibration.json", readings) == estimate(joint, readings)


def test_joint_calibrations_that_are_refused(tmp_path: Path, joint: JointCalibration) -> None:
    path = save(joint, tmp_path / "calibration.json")
    data = json.loads(path.read_text())
    a = data["readings"]["a"]
    cases = {
        "version 7, this finger3d reads version 1": {"version": 7},
        "readings: there are none": {"readings": {}},
        "readings.a.kind: missing": {"readings": {"a": 3}},
        "readings.a.kind = 'x': must be gauge": {"readings": {"a": a | {"kind": "x"}}},
        "readings.a: must have a reading and tolerances": {"readings": {"a": a | {"curve": a["curve"][:7]}}},
        "readings.a.noise = 0.0: must be a number": {"readings": {"a": a | {"noise": 0.0}}},
        "mu: must be at least 4 values that ascend": {"mu": data["mu"][::-1]},
    }
    for told, change in cases.items():
        path.write_text(json.dumps(data | change))
        with pytest.raises(Finger3dError, match=told):
            load(path)
