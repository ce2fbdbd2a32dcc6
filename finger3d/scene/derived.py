"""Materials of the parts of a finger, and legs of a press, derived from the tables of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._types import Float, TreeView
from finger3d.fem.laws.material import RIGID_RATIO, Isotropic
from finger3d.geometry.design import Design
from finger3d.materials.modulus import ElasticConstants
from finger3d.mechanics.model import Leg, contact_path
from finger3d.objects import PlacedObject, RigidObject
from finger3d.scene.material import mistakes
from finger3d.scene.messages import dotted, shown, unknown
from finger3d.scene.tables import SceneTable

GRAVITY = 9.80665
"""Standard acceleration of free fall, m/s2."""

_DEEPER = 1.25
"""Depth for whose contact fingers that close with a force are meshed, over its forecast, which ten of ten grips exceed
by some 20 %, and were then meshed and pressed again."""

_NU_OF_RIGID = 0.3  # of a material that hardly deforms, any does


def parts_of(tables: SceneTable) -> tuple[tuple[str, Isotropic], ...]:
    """Return label and material of every part with a table of its own.

    Young's modulus of a rigid part is `RIGID_RATIO` times the largest of the elastic materials.
    """
    elastic = {label: part.constants for label, part in tables.parts.items() if not part.rigid}
    stiffest = max(one.E_MPa for one in (tables.material.constants, *elastic.values()))
    rigid = Isotropic(RIGID_RATIO * stiffest, _NU_OF_RIGID)
    return tuple((label, _isotropic(elastic[label]) if label in elastic else rigid) for label in tables.parts)


def _isotropic(constants: ElasticConstants) -> Isotropic:
    return Isotropic(constants.E_MPa, constants.nu)


def spreads(tables: SceneTable) -> dict[str, float]:
    """Return the relative standard deviations of the Young's moduli of the finger that are not given.

    They stand by the label of the part, that of the main body by "".
    """
    elastic = {"": tables.material, **{label: part for label, part in tables.parts.items() if not part.rigid}}
    return {label: s for label, table in elastic.items() if (s := table.constants.spread) is not None}


def largest_spread(tables: SceneTable) -> float | None:
    """Return the largest relative standard deviation of a Young's modulus of the finger; None if all are given."""
    return max(spreads(tables).values(), default=None)


def moduli(tables: SceneTable) -> dict[str, str]:
    """Return Young's modulus of the finger and of its parts as text with spread and origin, by the name of the part."""
    origins = {"modulus": str(tables.material.constants)}
    for label, part in tables.parts.items():
        origins[f"modulus of {label}"] = "rigid" if part.rigid else str(part.constants)
    return origins


def check_parts(tables: SceneTable, design: Design) -> list[str]:
    """Return a line about every table whose part the finger lacks, or that has too few or too many keys."""
    lines = []
    for label, part in tables.parts.items():
        place = ("parts", label)
        constants = {key: value for key, value in part.model_dump(exclude={"rigid"}).items() if value is not None}
        if label not in design.part_labels:
            lines.append(unknown(place, {}, design.part_labels, kind=f"part of {design.name}"))
        elif part.rigid and constants:
            key, value = next(iter(constants.items()))
            lines.append(f"{dotted((*place, key))} = {shown(value)}: not with rigid = true; take one of the two out")
        elif not part.rigid:
            lines += [f"{line}; or rigid = true" for line in mistakes(part, place).values()]
    return lines


def path_of(legs: Iterable[TreeView], design: Design, obj: RigidObject, tables: SceneTable) -> tuple[Leg, ...]:
    """Return the legs of a press or a grip, angles in radians, with a forecast of the depth where a force is given."""
    grip = tables.grip
    if grip is None:
        return tuple(_leg(leg, design, obj, tables) for leg in legs)
    close = replace(_leg(dict(grip.closing), design, obj, tables), force_y_N=0.0)
    if grip.force_N is not None:
        close = replace(close, force_N=2.0 * grip.force_N, depth_mm=_DEEPER * close.depth_mm)
    down = np.array(grip.down) / (np.linalg.norm(grip.down) or 1.0)
    weight, load = GRAVITY * 1e-3 * grip.mass_g * down, np.array(grip.load_N)
    moment = np.array(grip.load_Nmm)
    solid, mirrors = tables.model.domain == "solid", _mirrors_of_load(tables, design, obj)
    under = [(weight, 0.0 * moment)] if weight.any() else []
    under += [(weight + load, moment)] if load.any() or moment.any() else []
    return (close, *(replace(close, **_loads(force, about, solid, mirrors)) for force, about in under))


def _mirrors_of_load(tables: SceneTable, design: Design, obj: RigidObject) -> set[str]:
    """Return the axes along which fingers, object and its load are their own mirror images."""
    grip = tables.grip
    assert grip is not None
    found = {*design.mirrors(), "z" if tables.model.domain != "solid" else ""} & {*PlacedObject.of(obj, 0.0).mirrors()}
    moment = np.array(grip.load_Nmm)
    for axis, i in (("x", 0), ("z", 2)):
        along = (grip.mass_g * grip.down[i], grip.load_N[i], grip.centre_mm[i])
        if any(along) or np.delete(moment, i).any():
            found -= {axis}
    return found


def _loads(force: Float, moment: Float, solid: bool, mirrors: set[str]) -> dict[str, Any]:
    """Return the forces and moments of a leg, but for those of coordinates that a symmetry holds."""
    held = {"x": {"force_x_N", "moment_y_Nmm", "moment_z_Nmm"}, "z": {"force_z_N", "moment_x_Nmm", "moment_y_Nmm"}}
    loads = {f"force_{axis}_N": float(force[i]) for i, axis in enumerate("xyz")}
    loads |= {f"moment_{axis}_Nmm": float(moment[i]) for i, axis in enumerate("xyz")}
    out = set[str]().union(*(held[axis] for axis in mirrors)) | (set() if solid else held["z"])
    return {key: value for key, value in loads.items() if key not in out}


def _leg(table: TreeView, design: Design, obj: RigidObject, tables: SceneTable) -> Leg:
    turns = {f"turn_{axis}": math.radians(table[f"turn_{axis}_deg"]) for axis in "xyz"}
    leg = {key: value for key, value in table.items() if not key.startswith("turn_")} | turns
    if leg["depth_mm"] is None:
        from finger3d.mechanics.march.equilibrium import forecast_depth

        constants = tables.material.constants
        material = Isotropic(constants.E_MPa, constants.nu)
        way = contact_path(design, obj, (), tables.model.domain)
        leg["depth_mm"] = forecast_depth(way, material, leg["force_N"], design.height_mm, design.width_mm)
    for axis in "xz":
        if (force := leg[f"force_{axis}_N"]) is not None:
            leg[f"slide_{axis}_mm"] = forecast_slide(tables.material.constants, force, design)
    return Leg(**leg)


def forecast_slide(constants: ElasticConstants, force: float, design: Design) -> float:
    """Return a rough slide (mm) under a tangential force (N): simple shear of half of the finger's base area."""
    shear = constants.E_MPa / (2.0 * (1.0 + constants.nu))
    slide = force * design.height_mm / (shear * design.half_length_mm * design.width_mm)
    return math.copysign(min(abs(slide), 0.5 * design.half_length_mm), force)
