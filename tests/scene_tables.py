"""The least scene, as tables."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

FINGER = {
    "geometry": "clipped_cylinder",
    "radius_mm": 100.0,
    "half_length_mm": 50.0,
    "edge_height_mm": 36.6,
    "width_mm": 20.0,
}
HEIGHT = 36.6 + 100.0 - math.sqrt(100.0**2 - 50.0**2)  # of its crown

SMALL = {
    "finger": FINGER,
    "material": {"E_MPa": 1.0, "nu": 0.49},
    "press": {"depth_mm": 10.0},
    "effects": {"auto": False},
}

HALF_CYLINDER: dict[str, Any] = {
    "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 4.0},
    "material": {"E_MPa": 1.0, "nu": 0.3},
    "press": {"depth_mm": 0.5},
    "effects": {"auto": False},
}


def scene_with_object(path: Path, **table: Any) -> dict[str, Any]:
    """The half cylinder under a triangulated object, with other keys of its table."""
    return {**HALF_CYLINDER, "object": {"shape": "mesh", "path": str(path), **table}}
