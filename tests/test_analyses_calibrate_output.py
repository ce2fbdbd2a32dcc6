"""Files of a calibration."""

from __future__ import annotations

from pathlib import Path

import pytest

from finger3d.analyses.calibrate.run import calibrate
from finger3d.errors import Finger3dError
from finger3d.io import claimed
from finger3d.scene import load as load_scene
from tests.sensor_cases import FEW, NONE, scene


def test_a_folder_takes_one_calibration_at_a_time(tmp_path: Path) -> None:
    with claimed(tmp_path), pytest.raises(Finger3dError, match="writing"):
        calibrate(scene(), "g36", tmp_path)


def test_the_scene_kept_beside_a_calibration_is_the_scene(tmp_path: Path) -> None:
    calibrate(scene(), "g36", tmp_path, FEW[:4], tolerances=NONE)
    assert load_scene(tmp_path / "scene.toml") == scene()
