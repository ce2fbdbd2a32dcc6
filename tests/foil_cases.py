"""Bodies with foils inside, and scenes that name them."""

from __future__ import annotations

from finger3d.effects.embedded_gauge import Effect
from finger3d.mechanics.model import Gauge, Leg, Model
from tests import models

FOIL = Effect(3000.0, 0.02, 1.0)
LEGS = (Leg(0.3, steps=3, duration_s=1.0), Leg(0.3, slide_x_mm=0.1, steps=2, duration_s=1.0))
MIDDLE = Gauge("g", 0.0, 1.6, 0.0, 0.0, 2.0)
FOIL_TABLE = {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0}
GOOD = {"name": "g", "x_mm": 0.0, "y_mm": 3.0, "length_mm": 2.0}


def block(**changes: object) -> Model:
    """A block under a ball with a gauge in its middle."""
    return models.block(**{"gauges": (MIDDLE,), "legs": LEGS[:1]} | changes)


def scene_of(effect: dict, *gauges: dict, **more: object) -> dict:
    return {
        "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 4.0},
        "material": {"E_MPa": 1.0, "nu": 0.3}, "press": {"depth_mm": 0.5}, "gauge": gauges,
        "effects": {"embedded_gauge": effect}, **more,
    }  # fmt: skip
