"""Python files that are imported by folder: the designs of geometries/, and the studies of a validation folder."""

from __future__ import annotations

import functools
import importlib
import sys
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

from finger3d.errors import MissingError
from finger3d.geometry.design import ParametricDesign


def import_from(folder: Path, package: str, name: str) -> ModuleType:
    """Import the file `name`.py of a folder as the module `package`.`name`; its relative imports find its neighbours.

    The folder becomes a namespace package, as if its parent were on the module path. A package of that name from
    another folder is dropped.
    """
    known = sys.modules.get(package)
    if known is None or list(known.__path__) != [str(folder)]:
        for module in [m for m in sys.modules if m == package or m.startswith(f"{package}.")]:
            del sys.modules[module]
        spec = ModuleSpec(package, None, is_package=True)
        spec.submodule_search_locations = [str(folder)]
        sys.modules[package] = module_from_spec(spec)
    return importlib.import_module(f"{package}.{name}")


@functools.cache
def designs() -> dict[str, type]:
    """Return the designs by name: one file each in geometries/, beside the package in a checkout, inside it in a wheel.

    Raises
    ------
    MissingError
        If there is no such folder.
    """
    package = Path(__file__).resolve().parents[1]
    folders = [package / "geometries", package.parent / "geometries"]
    folder = next((f for f in folders if f.is_dir()), None)
    if folder is None:
        raise MissingError(f"no folder of designs: looked for {folders[0]} and {folders[1]}; reinstall finger3d")
    found: dict[str, type] = {}
    for file in sorted(folder.glob("[a-z]*.py")):
        module = import_from(folder, "finger3d.geometries", file.stem)
        for value in vars(module).values():
            if isinstance(value, type) and value.__module__ == module.__name__ and issubclass(value, ParametricDesign):
                found[value.name] = value
    return found
