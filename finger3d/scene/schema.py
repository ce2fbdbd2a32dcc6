"""JSON schema of a scene, from the tables that check it; editors complete and check a scene file by it.

A schema states what each key takes by itself, and which keys a design, a shape or an effect has.  Conditions between
keys, such as a depth below the finger's height, are checked when the scene is loaded.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from typing import Any

from finger3d._types import Tree
from finger3d.effects import effect_names, effect_type
from finger3d.geometry.design import designs
from finger3d.geometry.files import SUFFIXES
from finger3d.materials.modulus import MODULUS_KEYS
from finger3d.meshing.mesh_files import MESH_SUFFIXES
from finger3d.objects import OBJECTS
from finger3d.scene import tables
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

_SAID = re.compile(r"^    (\w+(?:, \w+)*) : (.+(?:\n     +\S.*)*)", flags=re.MULTILINE)

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
    fingers = [_named("geometry", name, design) for name, design in designs().items()]
    fingers += [_file("STEP or STL file", SUFFIXES, FileTable), _file("mesh file", MESH_SUFFIXES, MeshFileTable)]
    shapes = [_named("shape", name, record) for name, record in OBJECTS.items()]
    plane = next(shape for shape in shapes if shape["properties"]["shape"]["const"] == "plane")
    plane["required"].remove("shape")  # [object] without a shape is a plane
    depth_or_force = {"oneOf": [{"required": ["depth_mm"]}, {"required": ["force_N"]}]}
    press, legs = _of(PressTable, LegTable) | {"title": "one press"} | depth_or_force, _of(LegsTable)
    leg = {"items": _of(LegTable) | depth_or_force, "description": "targets, each reached from the one before"}
    legs["properties"]["leg"] |= leg
    for key, description, choices in (
        ("finger", "what is pressed", fingers),
        ("object", "what the finger is pressed on; without it a rigid plane", shapes),
        ("press", "the motion of the object", [press, legs | {"title": "legs"}]),
    ):
        keys[key] = {"description": description, "type": "object", "oneOf": choices}
    one_modulus = [{"required": [key]} for key in MODULUS_KEYS]
    keys["material"] |= {"oneOf": one_modulus, "dependentRequired": {"E_MPa": ["nu"]}}
    effects = _of(AutoTable)["properties"]
    for name in effect_names():
        effect = effect_type(name)
        effects[name] = {"oneOf": [{"type": "boolean"}, _of(table_of(effect), effect)]}
    keys["effects"] = {"type": "object", "additionalProperties": False, "properties": effects}
    root["oneOf"] = [{"required": ["press"]}, {"required": ["grip"]}]
    for name, description in descriptions(SceneTable).items():
        keys[name] |= {"description": description}
    return {"$schema": DIALECT, "title": "A scene of finger3d"} | root


def descriptions(documented: type) -> dict[str, str]:
    """Return the description of each key in the docstrings of a class and its bases."""
    texts: dict[str, str] = {}
    for base in reversed(documented.__mro__):
        for names, text in _SAID.findall(base.__doc__ or ""):
            texts |= dict.fromkeys(names.split(", "), " ".join(text.split()))
    missing = [f.name for f in dataclasses.fields(documented)] if dataclasses.is_dataclass(documented) else []
    return dict.fromkeys(missing, "") | texts


def _named(key: str, name: str, record: type) -> Tree:
    """Return the schema of the table of a design or an object, whose `key` must be `name`."""
    table_schema = _of(table_of(record), record)
    table_schema["title"] = name
    table_schema["properties"] = {key: {"const": name}} | table_schema["properties"]
    table_schema["required"] = [key, *table_schema["required"]]
    return table_schema


def _file(title: str, suffixes: Sequence[str], table: type[TomlTable]) -> Tree:
    """Return the schema of [finger] with a file; JSON Schema has no flag for endings in capitals."""
    either_case = ("".join(f"[{c}{c.upper()}]" if c.isalpha() else c for c in s.removeprefix(".")) for s in suffixes)
    pattern = rf"\.({'|'.join(either_case)})$"
    path = {"type": "string", "pattern": pattern, "description": "path from the scene's folder"}
    own = _of(table)
    return own | {"title": title, "properties": {"geometry": path} | own["properties"], "required": ["geometry"]}


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
    choices = out.get("anyOf")
    if not isinstance(choices, list):
        return out
    choices = [choice for choice in out.pop("anyOf") if choice != {"type": "null"}]
    return choices[0] | out if len(choices) == 1 else out | {"anyOf": choices}
