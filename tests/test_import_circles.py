"""Imports of the package form no circle, those for type checking and those inside functions included."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import finger3d

ROOT = Path(finger3d.__file__).parent


def name_of(path: Path) -> str:
    parts = ("finger3d", *path.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(path: Path, modules: set[str]) -> set[str]:
    """Modules of the package that a file imports anywhere; of a package, those files that names are taken from."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= (inner & modules) or {node.module}
    return found & modules


def graph() -> dict[str, set[str]]:
    files = {name_of(path): path for path in ROOT.rglob("*.py")}
    return {name: imported(path, set(files)) - {name} for name, path in files.items()}


def test_no_module_imports_itself_by_way_of_others() -> None:
    arrows = graph()
    assert arrows["finger3d.mechanics.discretise.build"]  # arrows are found
    try:
        TopologicalSorter(arrows).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None
