"""Readings of the reference body and of bodies that differ from it."""

from __future__ import annotations

from typing import Any

import pytest

from finger3d.analyses.calibrate.variations import with_modulus
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from tests.sensor_cases import SCENE, scene


def test_modulus_from_the_same_condensation_is_that_of_another_scene() -> None:
    changes: dict[str, Any] = {
        "effects": {
            "elastic_object": {"E_MPa": 2.0, "nu": 0.4},
            "embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0},
        },
        "gauge": [SCENE["gauge"][1]],
        "friction": {"mu": 0.3},
    }
    *_, scaled = march(with_modulus(build(scene(**changes).model()), 1.1))
    *_, built = march(build(scene(**changes, material={"E_MPa": 1.1, "nu": 0.45}).model()))
    for name in ("long", "long_free"):
        assert scaled.gauges[name] == pytest.approx(built.gauges[name], rel=1e-9)
