"""Sweeps: every combination of some values of a scene's keys, on Dask workers, resumable; a body is condensed once."""

from finger3d.sweep.kept import Kept
from finger3d.sweep.points import Sweep, combinations
from finger3d.sweep.run import sweep

__all__ = ["Kept", "Sweep", "combinations", "sweep"]
