"""Frictional contact of an elastic, finger-shaped tactile sensor in 3D.

The commands that compute are functions, too: `press`, `compare`, `cost`, `calibrate`, `estimate`, `identify`, `sweep`,
`optimise`, `place_gauges` (``optimise --gauges``), `sensitivity`, `export` and `plan`. Names are loaded when they are
first used, so that ``import finger3d`` is quick.

>>> import finger3d
>>> result = finger3d.press("scene.toml")
>>> result.last.outcome
'converged'

The designs make plain build123d solids, which any viewer shows and any CAD program takes:

>>> finger = finger3d.designs()["half_cylinder"](radius_mm=5.0, width_mm=2.0)
>>> solid = finger.solid()
>>> round(solid.volume, 2), type(solid).__name__
(78.54, 'Solid')
>>> import build123d
>>> build123d.export_step(solid, "finger.step")
True
"""

from __future__ import annotations

import ast
from importlib import import_module

with open(f"{__path__[0]}/__init__.pyi", encoding="utf-8") as _table:
    _HOMES = {
        imported.name: statement.module
        for statement in ast.parse(_table.read()).body
        if isinstance(statement, ast.ImportFrom)
        for imported in statement.names
    }
"""Module of each public name, from the table that type checkers read."""

__all__ = sorted([*_HOMES, "__version__"])


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("finger3d")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
