"""Sweeps: every combination of some values of a scene's keys, on Dask workers, resumable; a body is condensed once.

Names are loaded when they are first used: what is swept in one process needs no Dask.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from finger3d.lazy import from_home

if TYPE_CHECKING:
    from finger3d.sweep.kept import Kept
    from finger3d.sweep.points import Sweep, combinations
    from finger3d.sweep.run import sweep

_HOME = {"Kept": "kept", "Sweep": "points", "combinations": "points", "sweep": "run"}

__all__ = ["Kept", "Sweep", "combinations", "sweep"]

__getattr__ = from_home(__name__, _HOME)
