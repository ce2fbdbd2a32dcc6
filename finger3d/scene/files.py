"""Files of bodies that a scene names: their paths and units."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, cast

from finger3d._types import Tree, TreeView
from finger3d.geometry.design import Design
from finger3d.geometry.files import SUFFIXES, content
from finger3d.meshing.mesh_files import MESH_SUFFIXES
from finger3d.objects import MeshObject, RigidObject
from finger3d.scene.tables import FileTable, MeshFileTable, TomlTable

if TYPE_CHECKING:
    from finger3d.geometry.imported import Imported
    from finger3d.meshing.given import GivenMesh

FINGER_SUFFIXES = (*SUFFIXES, *MESH_SUFFIXES)
"""Files that may be a finger; an object is no mesh of tetrahedra."""

_APART = 200.0  # sizes of object and finger that differ more than this are in different units, or cannot be meshed


def is_file(geometry: object) -> bool:
    """Whether finger.geometry names a file and not a design."""
    return isinstance(geometry, str) and geometry.lower().endswith(FINGER_SUFFIXES)


def table_of_file(path: str) -> type[TomlTable]:
    """Return the table of the keys beside a file."""
    return MeshFileTable if path.lower().endswith(MESH_SUFFIXES) else FileTable


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


def finger(path: str, table: TomlTable) -> Imported | GivenMesh:
    """Return the finger in a file, turned as its table says."""
    if path.lower().endswith(MESH_SUFFIXES):
        from finger3d.meshing.given import given_mesh

        return given_mesh(path, cast(MeshFileTable, table).scale)
    from finger3d.geometry.imported import imported

    file = cast(FileTable, table)
    return imported(path, scale=file.scale, up=file.up)


def unit_mistakes(design: Design, obj: RigidObject) -> list[str]:
    """Return a line if a triangulated object is far too large or far too small for the finger."""
    if not isinstance(obj, MeshObject):
        return []
    longest = max(design.height_mm, 2.0 * design.half_length_mm, design.width_mm)
    extent = obj.surface.high - obj.surface.low
    ratio = float(extent.max()) / longest
    if 1.0 / _APART <= ratio <= _APART:
        return []
    box = " x ".join(f"{e:.4g}" for e in extent)
    relation = f"{ratio:.3g} times as large as" if ratio > 1.0 else f"{1.0 / ratio:.3g} times smaller than"
    advice = "0.001 if it was drawn in micrometres" if ratio > 1.0 else "1000 if it was drawn in metres, 25.4 in inches"
    return [
        f"object.path: the object's box is {box} mm, {relation} the finger of {longest:.4g} mm; is its unit right? "
        f"Give object.scale, for instance {advice}"
    ]
