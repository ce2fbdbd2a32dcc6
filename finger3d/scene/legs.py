"""Legs of a press from the tables of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterable

from finger3d._types import TreeView
from finger3d.fem.material import Isotropic
from finger3d.geometry.design import Design
from finger3d.mechanics.model import Leg, contact_path
from finger3d.objects import RigidObject
from finger3d.scene.tables import SceneTable


def legs_of(legs: Iterable[TreeView], design: Design, obj: RigidObject, tables: SceneTable) -> tuple[Leg, ...]:
    """Return the legs of a press, angles in radians, with a forecast of the depth where a force is given."""
    return tuple(_leg(leg, design, obj, tables) for leg in legs)


def _leg(table: TreeView, design: Design, obj: RigidObject, tables: SceneTable) -> Leg:
    turns = {f"turn_{axis}": math.radians(table[f"turn_{axis}_deg"]) for axis in "xyz"}
    leg = {key: value for key, value in table.items() if not key.startswith("turn_")} | turns
    if leg["depth_mm"] is None:
        from finger3d.mechanics.force_control import forecast_depth

        constants = tables.material.constants
        material = Isotropic(constants.E_MPa, constants.nu)
        way = contact_path(design, obj, (), tables.model.domain)
        leg["depth_mm"] = forecast_depth(way, material, leg["force_N"], design.height_mm, design.width_mm)
    return Leg(**leg)
