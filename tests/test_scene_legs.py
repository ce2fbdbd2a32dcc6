"""Legs of a path."""

from __future__ import annotations

from finger3d.mechanics.model import Leg
from finger3d.scene import parse
from tests.scene_tables import SMALL


def test_legs_press_slide_and_release() -> None:
    legs = [{"depth_mm": 10.0}, {"depth_mm": 10.0, "slide_x_mm": 2.0, "steps": "auto"}, {"depth_mm": 0.0, "steps": 5}]
    model = parse({**SMALL, "press": {"leg": legs}}).model()
    assert model.legs == (Leg(10.0, steps="auto"), Leg(10.0, slide_x_mm=2.0, steps="auto"), Leg(0.0, steps=5))
