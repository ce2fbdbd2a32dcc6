"""Tables of a scene's file, each checked by itself, and the objects that they stand for; mistakes are collected."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from pydantic import ValidationError

from finger3d._ranges import PathName, one_line
from finger3d._types import Tree, TreeView
from finger3d.effects import effect_names, effect_type
from finger3d.errors import Finger3dError
from finger3d.geometry.design import Design, designs
from finger3d.geometry.files import SUFFIXES
from finger3d.meshing.mesh_files import MESH_SUFFIXES
from finger3d.objects import OBJECTS, RigidObject
from finger3d.scene.messages import Place, choose, described, dotted, listed, message, messages_from, nearest, unknown
from finger3d.scene.tables import (
    AutoTable,
    FileTable,
    GripTable,
    LegsTable,
    LegTable,
    MeshFileTable,
    PressTable,
    Record,
    TomlTable,
    record_of,
    table_of,
)
from finger3d.scene.tree import FINGER_SUFFIXES, is_file

if TYPE_CHECKING:
    from finger3d.geometry.imported import Imported
    from finger3d.meshing.given import GivenMesh

AnyTable = TypeVar("AnyTable", bound=TomlTable)


def checked(
    table: type[AnyTable], values: TreeView, under: Place, mistakes: dict[Place, str], also: tuple[str, ...] = ()
) -> AnyTable | None:
    try:
        return table.model_validate(values)
    except ValidationError as error:
        mistakes |= messages_from(error, table, values, under, also)
        return None


def built(record: type[Record], settings: TomlTable, place: Place, mistakes: dict[Place, str]) -> Record | None:
    """Build a design or an effect; values that it refuses are collected as mistakes."""
    try:
        return record_of(record, settings)
    except Finger3dError as error:
        mistakes[place] = f"{dotted(place)}: {error}"
        return None


def design_of(geometry: str, dimensions: TomlTable | None, mistakes: dict[Place, str]) -> Design | None:
    """Build the finger from a design, or read it from a file."""
    if dimensions is None:
        return None
    if not is_file(geometry):
        design: Design | None = built(designs()[geometry], dimensions, ("finger",), mistakes)
        return design
    try:
        return _finger(geometry, dimensions)
    except Finger3dError as error:
        mistakes["finger", "geometry"] = f"finger.geometry: {error}"
        return None


def _finger(path: str, table: TomlTable) -> Imported | GivenMesh:
    """Return the finger in a file, turned as its table says."""
    if path.lower().endswith(MESH_SUFFIXES):
        from finger3d.meshing.given import given_mesh

        return given_mesh(path, cast(MeshFileTable, table).scale)
    from finger3d.geometry.imported import imported

    file = cast(FileTable, table)
    return imported(path, scale=file.scale, up=file.up)


def _table_of_file(path: str) -> type[TomlTable]:
    """Return the table of the keys beside a file."""
    return MeshFileTable if path.lower().endswith(MESH_SUFFIXES) else FileTable


def object_of(shape: str, placed: TomlTable | None, mistakes: dict[Place, str]) -> RigidObject | None:
    """Build the object; defects of its file are collected as mistakes."""
    if placed is None:
        return None
    try:
        return record_of(OBJECTS[shape], placed).read()
    except Finger3dError as error:
        hint = "; give its path from the scene's folder" if str(error).endswith("there is no such file") else ""
        mistakes["object", "path"] = f"object.path: {error}{hint}"
        return None


def shaped(table: Any) -> Any:
    """Return the [object] table, with the default shape if it names none."""
    if not isinstance(table, Mapping) or "shape" in table or any(nearest(k, ("shape",)) for k in table):
        return table
    return {"shape": "plane", **table}


def named(
    document: TreeView, name: str, key: str, types: Mapping[str, type], mistakes: dict[Place, str]
) -> tuple[str, TomlTable | None]:
    """Check a table whose `key` says which other keys it takes."""
    given_table = document.get(name)
    if not isinstance(given_table, Mapping):
        return "", None  # found by the check of the whole file
    if key not in given_table:
        misspelt = next((k for k in given_table if nearest(k, (key,))), None)
        if misspelt:
            mistakes[name, misspelt] = unknown((name, misspelt), given_table[misspelt], (key,))
        else:
            mistakes[name, key] = f"{name}.{key} is missing: must be {listed(types)}"
        return "", None
    place, value, rest = (name, key), given_table[key], {k: v for k, v in given_table.items() if k != key}
    if isinstance(value, str) and not one_line(value):
        mistakes[place] = message(place, value, f"must be {described(PathName)}")
        return "", None
    if name == "finger" and is_file(value):
        if not Path(value).exists():
            # Reported alone: the other keys may be those of the design that the file replaces.
            advice = f"give its path from the scene's folder, or a design: {listed(types)}"
            mistakes[place] = f"{name}.{key}: {value}: there is no such file; {advice}"
            return "", None
        extra: dict[Place, str] = {}
        table = checked(_table_of_file(value), rest, (name,), extra, also=(key,))
        mistakes |= {p: t.replace("no such key", "no such key beside this file, take it out") for p, t in extra.items()}
        return value, table
    if name == "finger" and isinstance(value, str) and "." in value:
        mistakes[place] = message(place, value, f"a file must be named {listed(FINGER_SUFFIXES)}")
    elif name == "object" and isinstance(value, str) and value.lower().endswith(SUFFIXES):
        mistakes[place] = message(place, value, 'must be "mesh", and the file its path')
    elif not isinstance(value, str) or value not in types:
        mistakes[place] = choose(place, value, list(types))
    else:
        return value, checked(table_of(types[value]), rest, (name,), mistakes, also=(key,))
    return "", None


def press_of(document: TreeView, mistakes: dict[Place, str]) -> PressTable | LegsTable | None:
    press, grip = document.get("press"), document.get("grip")
    if press is None and grip is None:
        mistakes["press",] = "press is missing: a table is required, or [grip] for two fingers"
    if press is not None and grip is not None:
        mistakes["press",] = (
            "press: must not stand beside [grip], whose fingers close by themselves; take one of the two out"
        )
    if isinstance(grip, Mapping):
        return _closing(grip, mistakes)
    if not isinstance(press, Mapping):
        return None  # found by the check of the whole file
    if "leg" not in press:
        return checked(PressTable, press, ("press",), mistakes, also=("leg",))
    if both := [k for k in press if k in LegTable.model_fields]:
        beside = "must not stand beside [[press.leg]]; give either one press or its legs"
        mistakes["press", both[0]] = message(("press", both[0]), press[both[0]], beside)
        return None
    return checked(LegsTable, press, ("press",), mistakes)


def _closing(grip: TreeView, mistakes: dict[Place, str]) -> PressTable | None:
    """Return the press of each of two fingers as they close."""
    table = checked(GripTable, grip, ("grip",), {})
    if table is None:
        return None  # found by the check of the whole file
    if (table.force_N is None) == (table.closing_mm is None):
        mistakes["grip",] = "grip: must have either force_N or closing_mm, by which its fingers close"
        return None
    return table.closing


def effects_of(document: TreeView, mistakes: dict[Place, str]) -> tuple[dict[str, TomlTable], Tree, AutoTable | None]:
    """Check the effects that are present, the only ones that are imported; return their tables and their settings, and
    which are used only where they are needed.
    """
    tables: dict[str, TomlTable] = {}
    effects: Tree = {}
    present = document.get("effects")
    present = present if isinstance(present, Mapping) else {}
    keys = {name: value for name, value in present.items() if name in AutoTable.model_fields}
    auto = checked(AutoTable, keys, ("effects",), mistakes, also=effect_names())
    if auto and auto.auto_tolerance and auto.auto is False:
        place = ("effects", "auto_tolerance")
        mistakes[place] = message(place, auto.auto_tolerance, "nothing is judged with effects.auto = false")
    for name, settings in present.items():
        if name in AutoTable.model_fields:
            continue
        place, settings = ("effects", name), {} if settings is True else settings
        if name not in effect_names():
            mistakes[place] = unknown(place, settings, (*effect_names(), *AutoTable.model_fields), kind="effect")
        elif settings is False:
            continue
        elif not isinstance(settings, Mapping):
            mistakes[place] = message(place, settings, f"must be a table, [{dotted(place)}], true or false")
        elif table := checked(table_of(effect_type(name)), settings, place, mistakes):
            tables[name], effects[name] = table, built(effect_type(name), table, place, mistakes)
    return tables, effects, auto
