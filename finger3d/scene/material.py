"""Tables of a scene that give elastic constants: their mistakes, defaults, and what one key replaces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from finger3d._types import Tree, TreeView
from finger3d.errors import Finger3dError
from finger3d.materials.modulus import MODULUS_KEYS, NU
from finger3d.materials.silicones import silicone_named
from finger3d.scene.messages import Place, dotted, shown
from finger3d.scene.tables import ElasticTable, PartTable

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
        value = shown(getattr(table, keys[1]))
        return {second: f"{dotted(second)} = {value}: must not stand beside {keys[0]}; give one of {_CHOICE}"}
    if table.E_MPa is not None and table.nu is None:
        missing = (*place, "nu")
        return {missing: f"{dotted(missing)} is missing: a number from 0 to 0.5 is required beside E_MPa"}
    if table.silicone is not None:
        try:
            silicone_named(table.silicone)
        except Finger3dError as error:
            named = (*place, "silicone")
            return {named: f"{dotted(named)} = {shown(table.silicone)}: {error}"}
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
