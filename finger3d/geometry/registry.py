"""The designs of geometries/, by name."""

from __future__ import annotations

import functools
import importlib
import sys
import types
from pathlib import Path

from finger3d.errors import MissingError


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
