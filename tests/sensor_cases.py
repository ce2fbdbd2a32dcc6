"""The scene that tests of calibration press, what they leave out, and curves without a press."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.analyses.calibrate import TOLERANCES
from finger3d.scene import parse
from finger3d.sensor import Calibration, ReadingCurve, Tolerance

SCENE: dict[str, Any] = {
    "finger": {
        "geometry": "clipped_cylinder", "radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6,
        "width_mm": 20.0,
    },
    "material": {"E_MPa": 1.0, "nu": 0.45},
    "press": {"depth_mm": 10.0, "steps": 4},
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 3.0, "base_size_mm": 10.0, "mesher": "swept"},
    "effects": {"auto": False},
    "gauge": [
        {"name": "g36", "x_mm": 36.0, "y_mm": 40.0, "angle_deg": 30.0},
        {"name": "long", "x_mm": 30.0, "y_mm": 38.0, "angle_deg": 10.0, "length_mm": 4.0},
    ],
}  # fmt: skip
FEW = (0.05, 0.2, 0.4, 0.6, 0.9, 1.2)
NONE = dict.fromkeys(TOLERANCES, 0.0)


def scene(**changes: Any) -> Any:
    return parse({**SCENE, **changes, "effects": SCENE["effects"] | changes.get("effects", {})})


def curve(function: Any, **changes: Any) -> Calibration:
    """A calibration of one reading, g; changes are of its curve, or of the calibration."""
    mu = np.linspace(0.02, 1.2, 25)
    own = {name: changes.pop(name) for name in ("noise", "tolerances", "kind") if name in changes}
    return Calibration((ReadingCurve("g", mu, function(mu), **{"noise": 1.5e-4, **own}),), **{"limit": 0.1, **changes})


def straight(mu: Any) -> Any:
    return 0.09 - 0.0015 * mu


def saturating(mu: Any) -> Any:
    return 0.01 * np.exp(-4.0 * mu)


def kinked(mu: Any) -> Any:
    """Steep to mu = 0.6, nearly flat beyond."""
    return 0.02 - 0.02 * np.minimum(mu, 0.6) - 0.0012 * np.maximum(mu - 0.6, 0.0)


def turning(mu: Any) -> Any:
    return 0.01 * (mu - 0.6) ** 2


def line(slope: float) -> Any:
    """Straight, through 0.05 at mu = 0."""
    return lambda mu: 0.05 + slope * mu


def tolerance(name: str, sd: float, slope: float, curvature: float = 0.0) -> Tolerance:
    """A tolerance that has the same effect at every mu."""
    return Tolerance(name, "1", sd, np.full(25, slope), np.full(25, curvature))


def together(*curves: Calibration) -> Calibration:
    """Curves as readings a, b, c and so on of one sensor."""
    named = tuple(replace(one.readings[0], name=letter) for one, letter in zip(curves, "abcdef", strict=False))
    return Calibration(named, 0.1)


def opposite() -> Calibration:
    """Two readings that friction changes in opposite directions, and the depth in the same."""
    depth = tolerance("depth_mm", 0.1, 0.02)
    return together(curve(line(0.01), tolerances=(depth,)), curve(line(-0.006), tolerances=(depth,)))
