"""Designs with dimensions that several tests take, and the sizes with which they are meshed."""

from __future__ import annotations

from typing import Any

from finger3d.geometry.design import designs
from finger3d.mechanics.model import MeshOptions

GOOD: dict[str, dict[str, float]] = {
    "half_cylinder": {"radius_mm": 5.0, "width_mm": 10.0},
    "clipped_cylinder": {"radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6, "width_mm": 20.0},
    "block": {"half_length_mm": 20.0, "height_mm": 15.0, "width_mm": 10.0, "skin_mm": 2.0},
    "fingertip": {
        "radius_mm": 10.0,
        "half_length_mm": 8.0,
        "edge_height_mm": 8.0,
        "width_mm": 16.0,
        "skin_mm": 1.0,
        "core_half_length_mm": 3.0,
        "core_height_mm": 6.0,
    },
    "hemisphere": {"radius_mm": 5.0},
}
"""Typical dimensions of every design."""

FIG9 = designs()["clipped_cylinder"](100.0, 50.0, 36.6, 20.0)
"""The finger of Maeno 2004, Fig. 9, 20 mm wide."""

OPTIONS = MeshOptions(5.0, 10.0, "ftetwild")
ZONE = (-40.0, 40.0, -10.0, 10.0)
"""Sizes and contact zone with which pytetwild meshes the Fig. 9 finger in a second."""

HALF = designs()["half_cylinder"](5.0, 10.0)
SMALL = designs()["clipped_cylinder"](20.0, 10.0, 5.0, 8.0)


def make(name: str, **changes: Any) -> Any:
    """A design with these dimensions, but for some."""
    return designs()[name](**{**GOOD[name], **changes})


def zone_of(design: Any) -> tuple[float, float, float, float]:
    """A contact zone as wide as the design, and 0.8 times as long."""
    length, width = design.half_length_mm, design.width_mm
    return -0.4 * length, 0.4 * length, -0.5 * width, 0.5 * width
