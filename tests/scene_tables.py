"""The least scene, as tables."""

from __future__ import annotations

FINGER = {
    "geometry": "clipped_cylinder",
    "radius_mm": 100.0,
    "half_length_mm": 50.0,
    "edge_height_mm": 36.6,
    "width_mm": 20.0,
}


SMALL = {"finger": FINGER, "material": {"E_MPa": 1.0, "nu": 0.49}, "press": {"depth_mm": 10.0}}
