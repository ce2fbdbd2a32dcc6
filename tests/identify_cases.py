"""A measured press with known values, for the tests of identification."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

import finger3d
from finger3d.scene import parse
from tests.sensor_cases import scene

NOISE = {"normal_force_N": 0.5, "gauge_g36": 3e-4}
TRUE = {"material.E_MPa": 0.37, "friction.mu": 0.2}
PRESS = {"depth_mm": 10.0, "steps": 8}
FREE = {"material.E_MPa": (0.05, 5.0), "friction.mu": (0.05, 1.0)}


def bench(path: Path, seed: int = 0, stds: bool = False, offset: float = 0.0, **changes: Any) -> Path:
    """A measured press of the scene with the true values, with noise."""
    tables: dict[str, Any] = {"press": PRESS, **changes}
    material = {"nu": 0.45, "E_MPa": TRUE["material.E_MPa"]}
    true = parse(scene(**tables, material=material, friction={"mu": TRUE["friction.mu"]}).as_dict())
    random, rows = np.random.default_rng(seed), []
    for step in finger3d.press(true).steps:
        found = {"normal_force_N": step.normal_force_N, "gauge_g36": step.gauges["g36"]}
        noisy = {name: value + NOISE[name] * random.normal() for name, value in found.items()}
        extra = {f"{name}_std": NOISE[name] for name in found} if stds else {}
        rows.append({"depth_mm": step.depth_mm + offset, **noisy, **extra})
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return path
