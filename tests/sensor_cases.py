"""The scene that tests of calibration press, what they leave out, and curves without a press."""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.scene import parse
from finger3d.sensor import Calibration

SCENE: dict[str, Any] = {
    "finger": {
        "geometry": "clipped_cylinder", "radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6,
        "width_mm": 20.0,
    },
    "material": {"E_MPa": 1.0, "nu": 0.45},
    "press": {"depth_mm": 10.0, "steps": 4},
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 3.0, "base_size_mm": 10.0, "mesher": "swept"},
    "gauge": [
        {"name": "g36", "x_mm": 36.0, "y_mm": 40.0, "angle_deg": 30.0},
        {"name": "long", "x_mm": 30.0, "y_mm": 38.0, "angle_deg": 10.0, "length_mm": 4.0},
    ],
}  # fmt: skip
FEW = (0.05, 0.2, 0.4, 0.6, 0.9, 1.2)
NONE = dict.fromkeys(TOLERANCES, 0.0)


def scene(**changes: Any) -> Any:
    return parse({**SCENE, **changes})


def curve(function: Any, **changes: Any) -> Calibration:
    mu = np.linspace(0.02, 1.2, 25)
    return Calibration("g", mu, function(mu), **{"noise": 1.5e-4, "limit": 0.1, **changes})


def straight(mu: Any) -> Any:
    return 0.09 - 0.0015 * mu


def saturating(mu: Any) -> Any:
    return 0.01 * np.exp(-4.0 * mu)


def kinked(mu: Any) -> Any:
    """Steep to mu = 0.6, nearly flat beyond."""
    return 0.02 - 0.02 * np.minimum(mu, 0.6) - 0.0012 * np.maximum(mu - 0.6, 0.0)


def turning(mu: Any) -> Any:
    return 0.01 * (mu - 0.6) ** 2
