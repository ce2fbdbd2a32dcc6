"""Sweeps: every combination of some values of a scene's keys, on Dask workers, resumable; a body is condensed once.

Names are loaded when they are first used: the child that draws needs none of them.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from finger3d.sweep.kept import Kept
    from finger3d.sweep.points import Sweep, combinations
    from finger3d.sweep.run import sweep

_HOME = {"Kept": "kept", "Sweep": "points", "combinations": "points", "sweep": "run"}

__all__ = ["Kept", "Sweep", "combinations", "sweep"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(f"finger3d.sweep.{_HOME[name]}"), name)
    raise AttributeError(f"module 'finger3d.sweep' has no attribute {name!r}")
