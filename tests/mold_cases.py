"""Fingers and gauges whose molds are tested."""

from __future__ import annotations

import math

from finger3d.mechanics.model import Gauge
from finger3d.scene import parse

BODIES = {
    "clipped_cylinder": {"radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6, "width_mm": 20.0},
    "half_cylinder": {"radius_mm": 5.0, "width_mm": 10.0},
    "block": {"half_length_mm": 20.0, "height_mm": 20.0, "width_mm": 20.0},
    "hemisphere": {"radius_mm": 8.0},
}


GAUGES = (
    Gauge("g36", 36.0, 40.0, angle=math.radians(30.0)),
    Gauge("low", -20.0, 10.0, z_mm=3.0, angle=math.radians(90.0), length_mm=4.0),
    Gauge("low, other side", -20.0, 10.0, z_mm=-3.0, angle=math.radians(90.0), length_mm=4.0),
)


def scene_of(name: str, **more):
    return parse(
        {
            "finger": {"geometry": name, **BODIES[name]},
            "material": {"E_MPa": 1.0, "nu": 0.45},
            "press": {"depth_mm": 1.0},
            **more,
        }
    )
