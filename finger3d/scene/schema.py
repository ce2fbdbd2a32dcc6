"""JSON schema of a scene, from the tables that check it; editors complete and check a scene file by it.

A schema states what each key takes by itself, and which keys a design, a shape or an effect has.  Conditions between
keys, such as a depth below the finger's height, are checked when the scene is loaded.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from finger3d._types import Tree
from finger3d.effects import effect_names, effect_type
from finger3d.geometry.files import SUFFIXES
from finger3d.geometry.registry import designs
from finger3d.materials.elastic import MODULUS_KEYS
from finger3d.meshing.given.mesh_files import MESH_SUFFIXES
from finger3d.objects import OBJECTS
from finger3d.scene import tables
from finger3d.scene.reference import descriptions
from finger3d.scene.tables import (
    AutoTable,
    FileTable,
    LegsTable,
    LegTable,
    MeshFileTable,
    PressTable,
    SceneTable,
    TomlTable,
    table_of,
)

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> Tree:
    """Return the JSON schema (draft 2020-12) of a scene.

    Returns
    -------
    dict
        Its definitions are inlined. ``[finger]`` is one of the designs, by ``geometry``, or a file; ``[object]`` one of
        the shapes, by ``shape``; ``[press]`` one press or its legs.
    """
    root = _of(SceneTable)
    keys = root["properties"]
    keys["finger"] = _one_of("what is pressed", [*map(_design, designs().items()), *_files()])
    shapes = [_named("shape", name, table_of(record), record) for name, record in OBJECTS.items()]
    plane = next(shape for shape in shapes if shape["properties"]["shape"]["const"] == "plane")
    plane["required"].remove("shape")  # [object] without a shape is a plane
    keys["object"] = _one_of("what the finger is pressed on; without it a rigid plane", shapes)
    keys["press"] = _one_of("the motion of the object", [_press(), _legs()])
    keys["material"] |= _one_modulus()
    effects = _of(AutoTable)["properties"] | {
        name: {"oneOf": [{"type": "boolean"}, _documented(effect_type(name))]} for name in effect_names()
    }
    keys["effects"] = {"type": "object", "additionalProperties": False, "properties": effects}
    root["oneOf"] = [{"required": ["press"]}, {"required": ["grip"]}]
    for name, description in descriptions(SceneTable).items():
        keys[name] |= {"description": description}
    return {"$schema": DIALECT, "title": "A scene of finger3d"} | root


def _one_of(description: str, choices: list[Tree]) -> Tree:
    return {"description": description, "type": "object", "oneOf": choices}


def _design(item: tuple[str, type]) -> Tree:
    name, design = item
    return _named("geometry", name, table_of(design), design)


def _named(key: str, name: str, table: type[TomlTable], documented: type) -> Tree:
    """Return the schema of a table whose `key` must be `name`."""
    table_schema = _of(table, documented)
    table_schema["title"] = name
    table_schema["properties"] = {key: {"const": name}} | table_schema["properties"]
    table_schema["required"] = [key, *table_schema["required"]]
    return table_schema


def _files() -> list[Tree]:
    kinds = (("STEP or STL file", SUFFIXES, FileTable), ("mesh file", MESH_SUFFIXES, MeshFileTable))
    return [_file(title, suffixes, _of(table)) for title, suffixes, table in kinds]


def _file(title: str, suffixes: Sequence[str], table: Tree) -> Tree:
    names = _any_case("|".join(suffix.removeprefix(".") for suffix in suffixes))
    path = {"type": "string", "pattern": rf"\.({names})$", "description": "path from the scene's folder"}
    return table | {"title": title, "properties": {"geometry": path} | table["properties"], "required": ["geometry"]}


def _any_case(text: str) -> str:
    """Return a regular expression that matches a text in capitals too; JSON Schema has no flag for it."""
    return "".join(f"[{c}{c.upper()}]" if c.isalpha() else c for c in text)


def _one_modulus() -> Tree:
    return {"oneOf": [{"required": [key]} for key in MODULUS_KEYS], "dependentRequired": {"E_MPa": ["nu"]}}


def _press() -> Tree:
    return _of(PressTable, LegTable) | {"title": "one press", **_depth_or_force()}


def _legs() -> Tree:
    table_schema = _of(LegsTable)
    leg = _of(LegTable) | _depth_or_force()
    table_schema["properties"]["leg"] |= {"items": leg, "description": "targets, each reached from the one before"}
    return table_schema | {"title": "legs"}


def _depth_or_force() -> Tree:
    return {"oneOf": [{"required": ["depth_mm"]}, {"required": ["force_N"]}]}


def _documented(record: type) -> Tree:
    return _of(table_of(record), record)


def _of(table: type[TomlTable], documented: type | None = None) -> Tree:
    """Return the schema of a table, with the descriptions of its keys, in its own tables too."""
    table_schema = table.model_json_schema()
    nested = table_schema.pop("$defs", {})
    _describe(table_schema, documented or table)
    for name, one in nested.items():
        _describe(one, getattr(tables, name))
    result: Tree = _tidy(table_schema, nested)
    return {"properties": {}, "required": []} | result


def _describe(table_schema: Tree, documented: type) -> None:
    """Put the descriptions of a docstring beside the keys of a schema."""
    table_schema.pop("description", None)  # the docstring of the table
    said = descriptions(documented)
    for key, value in table_schema["properties"].items():
        if text := said.get(key) or said.get(key.removesuffix("_deg")):
            value["description"] = text


def _tidy(node: Any, definitions: Tree) -> Any:
    """Inline references, and drop null, which TOML has not, titles, and defaults of whole tables."""
    if isinstance(node, list):
        return [_tidy(item, definitions) for item in node]
    if not isinstance(node, Mapping):
        return node
    if "$ref" in node:
        inlined = definitions[node["$ref"].rpartition("/")[2]]
        return _tidy({**inlined, **{k: v for k, v in node.items() if k != "$ref"}}, definitions)
    out = {}
    for key, value in node.items():
        if key in ("properties", "$defs"):
            out[key] = {name: _tidy(item, definitions) for name, item in value.items()}
        elif key == "title" or (key == "default" and (value is None or isinstance(value, list | dict))):
            continue
        else:
            out[key] = _tidy(value, definitions)
    return _without_null(out)


def _without_null(node: Tree) -> Tree:
    choices = [choice for choice in _list(node.get("anyOf")) if choice != {"type": "null"}]
    rest = {key: value for key, value in node.items() if key != "anyOf"}
    if len(choices) == 1:
        return choices[0] | rest
    return rest | {"anyOf": choices} if choices else rest


def _list(value: object) -> Iterable[Tree]:
    return value if isinstance(value, list) else ()
