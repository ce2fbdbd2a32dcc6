"""From a design to a mesh: designs, CAD, tessellation, tets, snapping, structured meshes, cache."""

from __future__ import annotations

import functools
import importlib
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

from finger3d.design.report import MeshReport
from finger3d.design.swept import mesh_section, mesh_swept
from finger3d.errors import MissingError
from finger3d.mesh import Mesh

__all__ = ["MeshReport", "designs", "mesh_section", "mesh_solid"]


@functools.cache
def designs() -> dict[str, type]:
    """Designs by name: one file each in geometries/, beside the package in a checkout, inside it in a wheel."""
    package = Path(__file__).resolve().parents[1]
    folders = [package / "geometries", package.parent / "geometries"]
    folder = next((f for f in folders if f.is_dir()), None)
    if folder is None:
        raise MissingError(f"no folder of designs: looked for {folders[0]} and {folders[1]}; reinstall finger3d")
    parent = types.ModuleType("finger3d.geometries")
    parent.__path__ = [str(folder)]
    sys.modules.setdefault(parent.__name__, parent)
    found: dict[str, type] = {}
    for file in sorted(folder.glob("[a-z]*.py")):
        module = importlib.import_module(f"finger3d.geometries.{file.stem}")
        for value in vars(module).values():
            if isinstance(value, type) and value.__module__ == module.__name__ and hasattr(value, "name"):
                found[value.name] = value
    return found


def mesh_solid(
    design: Any,
    options: Any,
    zone: tuple[float, float, float, float],
    symmetry: tuple[str, ...] = (),
    say: Callable[[str], None] = lambda text: None,
) -> tuple[Mesh, MeshReport]:
    """Mesh a design with quadratic tets.

    Parameters
    ----------
    design : from geometries/
    options : size_mm in the zone, base_size_mm far from it, mesher "ftetwild" or "swept"
    zone : (x_min, x_max, z_min, z_max) mm where contact is predicted
    symmetry : "x", "z": mesh only x >= 0, z >= 0
    say : told what is being done

    Returns
    -------
    mesh : quadratic, facets labelled contact, base, ends, walls, symmetry_x, symmetry_z
    report : size and quality
    """
    if options.mesher == "swept":
        say("meshing (swept)")
        return mesh_swept(design, options, zone, symmetry)
    from finger3d.design.tetwild import mesh_tetwild

    return mesh_tetwild(design, options, zone, symmetry, say)
