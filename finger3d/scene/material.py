"""Materials of a finger and legs of a press, from the tables of a scene: their defaults and their mistakes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from finger3d._types import Float, Tree, TreeView
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import RIGID_RATIO, Isotropic
from finger3d.geometry.design import Design
from finger3d.materials.modulus import MODULUS_KEYS, NU, ElasticConstants
from finger3d.materials.silicones import silicone_named
from finger3d.mechanics.model import Leg, contact_path
from finger3d.objects import PlacedObject, RigidObject
from finger3d.scene.messages import Place, dotted, message, unknown
from finger3d.scene.tables import ElasticTable, PartTable, SceneTable

Elastic = TypeVar("Elastic", bound=ElasticTable)

_CHOICE = "E_MPa, shore_A, shore_00 or silicone"


def mistakes(table: ElasticTable, place: Place) -> dict[Place, str]:
    """Return the mistake of a table whose keys are each within their range, by its place.

    Parameters
    ----------
    place : of the table in the scene
    """
    keys = [key for key in MODULUS_KEYS if getattr(table, key) is not None]
    if not keys:
        missing = (*place, "E_MPa")
        return {missing: f"{dotted(missing)} is missing: a number from 1e-9 to 1e9 is required, or one of {_CHOICE}"}
    if len(keys) > 1:
        second = (*place, keys[1])
        beside = f"must not stand beside {keys[0]}; give one of {_CHOICE}"
        return {second: message(second, getattr(table, keys[1]), beside)}
    if table.E_MPa is not None and table.nu is None:
        missing = (*place, "nu")
        return {missing: f"{dotted(missing)} is missing: a number from 0 to 0.5 is required beside E_MPa"}
    if table.silicone is not None:
        try:
            silicone_named(table.silicone)
        except Finger3dError as error:
            named = (*place, "silicone")
            return {named: message(named, table.silicone, str(error))}
    return {}


def is_rigid(table: ElasticTable) -> bool:
    """Whether a table is that of a rigid part, which has no elastic constants."""
    return isinstance(table, PartTable) and table.rigid


def filled_in(table: Elastic) -> Elastic:
    """Return the table with Poisson's ratio and the silicone's own name; that of a rigid part as it is."""
    if is_rigid(table):
        return table
    changes: Tree = {"nu": table.constants.nu}
    if table.silicone is not None:
        changes["silicone"] = silicone_named(table.silicone).name
    return table.model_copy(update=changes)


def with_modulus(table: ElasticTable) -> Tree:
    """Return the keys of a table; if another key gives Young's modulus, with it, its spread and its origin."""
    values = {key: value for key, value in table.model_dump().items() if value is not None}
    if table.E_MPa is not None or is_rigid(table):
        return values
    constants = table.constants
    return values | {"E_MPa": constants.E_MPa, "E_spread": constants.spread, "E_origin": constants.origin}


def with_moduli_only(scene: TreeView) -> Tree:
    """Return the tables of `Scene.as_dict` with Young's moduli in place of what they follow from; they load again."""

    def own(table: TreeView) -> TreeView:
        return {key: table[key] for key in ("E_MPa", "nu")} if "E_origin" in table else table

    parts = {label: own(part) for label, part in scene["parts"].items()}
    return {**scene, "material": own(scene["material"]), "parts": parts}


def replace_modulus(tree: Tree, changed: Iterable[str]) -> None:
    """Remove from tables of `tree` the keys that changed ones replace, in place.

    A modulus given on the command line replaces the modulus, hardness or silicone of the file; the Poisson's ratio
    given or implied by the file is kept.

    Parameters
    ----------
    changed : dotted keys, such as ``material.E_MPa``
    """
    keys = [tuple(key.split(".")) for key in changed]
    for *where, last in keys:
        if last not in MODULUS_KEYS or not (where == ["material"] or where[:1] == ["parts"]):
            continue
        table = _table(tree, where)
        replaced = [k for k in MODULUS_KEYS if k in table and (*where, k) not in keys]
        for key in replaced:
            del table[key]
        if last == "E_MPa" and replaced and "nu" not in table:
            table["nu"] = NU


def modulus_of(tree: Mapping[str, object], key: str) -> float | None:
    """Return Young's modulus, MPa, if `key` is its key in a table that gives it by another one; else None."""
    *where, last = key.split(".")
    table = _table(tree, where)
    if last != "E_MPa" or not table:
        return None
    try:
        return ElasticTable.model_validate(dict(table)).constants.E_MPa
    except (Finger3dError, ValueError):
        return None  # the check of the whole scene reports the mistake


def _table(tree: Mapping[str, object], where: Iterable[str]) -> Any:
    """Return the table at a place, empty if there is none."""
    table: Any = tree
    for part in where:
        table = table.get(part, {}) if isinstance(table, Mapping) else {}
    return table if isinstance(table, Mapping) else {}


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
            lines.append(message((*place, key), value, "not with rigid = true; take one of the two out"))
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

        material = _isotropic(tables.material.constants)
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
