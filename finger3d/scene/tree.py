"""Scene files as trees of dicts and tuples: reading, overriding keys, files of bodies, and writing."""

from __future__ import annotations

import copy
import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from finger3d._types import Tree, TreeView
from finger3d.errors import Finger3dError
from finger3d.geometry.files import SUFFIXES, content
from finger3d.meshing.mesh_files import MESH_SUFFIXES
from finger3d.scene.material import replace_modulus
from finger3d.scene.messages import listed, nearest, shown

_ALTERNATIVES = (
    ("mesh", ("size_mm", "base_size_mm"), ("tolerance", "goal", "max_seconds")),
    ("press", ("depth_mm",), ("force_N",)),
)
"""Keys of a table that exclude each other; those that are set take the place of the others."""

_DEEPEST = 50
"""Most parts of a dotted key, and most levels of tables and lists: far above any scene."""

FINGER_SUFFIXES = (*SUFFIXES, *MESH_SUFFIXES)
"""Files that may be a finger; an object is no mesh of tetrahedra."""


def read(path: Path) -> Tree:
    """Read a TOML file; lists become tuples, which the strict tables ask for."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        near = " (a scene to start from: finger3d new)" if path.name == "scene.toml" else ""
        raise Finger3dError(f"{path}: there is no such file{near}") from None
    except IsADirectoryError:
        raise Finger3dError(f"{path}: this is a folder; name the scene file in it") from None
    except UnicodeDecodeError as error:
        raise Finger3dError(f"{path}: not TOML: byte {error.start} is not UTF-8 text") from None
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}") from None
    try:
        return frozen(_loads(text.replace("\r\n", "\n")))
    except tomllib.TOMLDecodeError as error:
        raise Finger3dError(f"{path}: not TOML: {_located(str(error), text)}") from None
    except (ValueError, RecursionError, Finger3dError):
        raise Finger3dError(
            f"{path}: not TOML: a number or a key is too long, or brackets are nested too deep"
        ) from None


def _loads(text: str) -> Tree:
    """Parse TOML; a dotted key would take memory that grows with the square of the number of its parts."""
    keys = (line.partition("=")[0] for line in text.splitlines() if not line.lstrip().startswith("#"))
    if any(key.count(".") > _DEEPEST for key in keys):
        raise ValueError("a dotted key has too many parts")
    return tomllib.loads(text)


def _located(message: str, text: str) -> str:
    lines = text.splitlines() or [""]
    end = f"(at line {len(lines)}, column {len(lines[-1]) + 1}, the end of the file)"
    return message.replace("(at end of document)", end)


def frozen(tree: Mapping[str, object]) -> Tree:
    """Return a copy with tuples in place of lists, which the strict tables require."""
    return {key: _with_tuples(value, _DEEPEST) for key, value in tree.items()}


def _with_tuples(value: object, levels: int) -> object:
    if not levels:
        raise Finger3dError(f"tables or lists are nested more than {_DEEPEST} levels deep; no key of a scene is")
    if isinstance(value, Mapping):
        return {key: _with_tuples(v, levels - 1) for key, v in value.items()}
    return tuple(_with_tuples(v, levels - 1) for v in value) if isinstance(value, list | tuple) else value


def plain(tree: Mapping[str, object]) -> Tree:
    """Return a copy with lists in place of tuples and without None, which TOML and JSON require."""
    return {key: _with_lists(value) for key, value in tree.items() if value is not None}


def _with_lists(value: object) -> object:
    if isinstance(value, Mapping):
        return plain(value)
    return [_with_lists(v) for v in value] if isinstance(value, list | tuple) else value


def override(tree: TreeView, overrides: Iterable[str], option: str = "--set") -> Tree:
    """Return `tree` with keys set from texts such as ``friction.mu=0.5`` or ``press.leg.0.depth_mm=3``.

    `option` is where the texts come from, for messages.
    """
    return overridden(tree, overrides, option)[0]


def overridden(tree: TreeView, overrides: Iterable[str], option: str = "--set") -> tuple[Tree, list[str]]:
    """Return what `override` returns, and the keys, with the numbers of readings in place of their names."""
    changed = copy.deepcopy(plain(tree))
    keys = []
    for text in overrides:
        key, equals, value = text.partition("=")
        parts = [p.strip() for p in key.split(".")]
        if not equals or not all(parts) or len(parts) > _DEEPEST:
            raise Finger3dError(f"{option} {shown(text)}: must be KEY=VALUE, for instance {option} friction.mu=0.5")
        keys.append(numbered(".".join(parts), changed, option))
        _set(changed, keys[-1].split("."), parsed(value.strip()), f"{option} {key.strip()}")
    replace_modulus(changed, keys)
    for table, *groups in _ALTERNATIVES:
        for one, other in (groups, reversed(groups)):
            mine, others = ({f"{table}.{name}" for name in names} & {*keys} for names in (one, other))
            for name in other if mine and not others else ():
                changed[table].pop(name, None)
    return frozen(changed), keys


def numbered(key: str, given: TreeView, option: str) -> str:
    """Return the key with a reading's name replaced by its number: ``gauge.g36.x_mm`` is ``gauge.0.x_mm``."""
    kind, name, last = (*key.split(".", 2), "", "")[:3]
    tables = given.get(kind, ())
    if kind not in ("gauge", "marker", "taxel") or not last or name.isdecimal() or not isinstance(tables, tuple | list):
        return key
    names = [str(table.get("name")) for table in tables if isinstance(table, Mapping)]
    if name not in names:
        near = nearest(name, names)
        hint = f'did you mean "{near}"? ' if near else ""
        known = f"must be {listed(names)}, or its number from 0" if names else f"the scene has no [[{kind}]]"
        raise Finger3dError(f"{option} {key}: no {kind} {shown(name)}; {hint}{known}")
    return f"{kind}.{names.index(name)}.{last}"


def value_at(tree: TreeView, key: str) -> object:
    """Return the value of a dotted key, None if the tree has none; tables in arrays are numbered from 0."""
    value: object = tree
    for part in key.split("."):
        if isinstance(value, tuple | list):
            value = value[int(part)] if _is_index(part, value) else None
        else:
            value = value.get(part) if isinstance(value, Mapping) else None
    return value


def _is_index(part: str, items: Sequence[object]) -> bool:
    return part.isdecimal() and len(part) <= len(str(len(items))) and int(part) < len(items)


def parsed(text: str) -> Any:
    """Return the TOML value of a text, or the text itself if it is no TOML."""
    try:
        tables = _loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return tables["value"] if tables.keys() == {"value"} else text


def _set(node: Any, parts: list[str], value: Any, key: str) -> None:
    for depth, part in enumerate(parts):
        last = depth == len(parts) - 1
        if isinstance(node, list):
            if not _is_index(part, node):
                name = ".".join(parts[:depth])
                allowed = f"0 to {len(node) - 1}, as {name}.0" if node else "none, the list is empty"
                raise Finger3dError(f"{key}: no item {shown(part)} in {name} ({allowed})")
            index: Any = int(part)
        elif isinstance(node, dict):
            index = part
            if not last and node.get(part, True) is True:  # true stands for an empty table
                node[part] = {}
        else:
            raise Finger3dError(f"{key}: {'.'.join(parts[:depth])} = {shown(node)} is not a table")
        if last and value is True and isinstance(node, dict) and isinstance(node.get(index), dict):
            return  # it is on already, with its own settings
        if last:
            node[index] = value
        else:
            node = node[index]


def is_file(geometry: object) -> bool:
    """Whether finger.geometry names a file and not a design."""
    return isinstance(geometry, str) and geometry.lower().endswith(FINGER_SUFFIXES)


def absolute(document: TreeView, scene: Path | None) -> Tree:
    """Return the tree with absolute paths of its bodies; those in it are relative to the file of the scene."""
    folder = scene.parent if scene else Path()
    tree = dict(document)
    for table, key, value in _named(document):
        tree[table] = {**document[table], key: os.path.realpath(folder / value)}
    return tree


def contents(document: TreeView, scene: Path | None = None) -> dict[str, str]:
    """Return the SHA-256 of each file of a body that a scene names, by its path."""
    named = absolute(document, scene)
    return {value: content(Path(value)) for _, _, value in _named(named)}


def _named(document: TreeView) -> Iterator[tuple[str, str, str]]:
    """Yield the table, the key and the path of each file of a body that a scene names."""
    for table, key in (("finger", "geometry"), ("object", "path")):
        keys = document.get(table)
        if isinstance(keys, Mapping) and isinstance(value := keys.get(key), str) and (key == "path" or is_file(value)):
            yield table, key, value


def written(tree: TreeView) -> str:
    """Write a tree as TOML text."""
    import tomli_w

    return tomli_w.dumps(plain(tree))
