"""Run of CalculiX's solver, and the forces that it prints."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np

from finger3d._types import Float
from finger3d.analyses.calculix.deck import OBJECT
from finger3d.errors import MissingError

_NUMBER = r"\s*([-+]?\d\.\d+E[-+]\d+)"
_TOTAL = re.compile(rf"total force \(fx,fy,fz\) for set {OBJECT} and time\s+(\S+)\s+{_NUMBER}{_NUMBER}{_NUMBER}")
_SAID = 300  # last characters of what it said, in a message


def program() -> str | None:
    """Return the path of ccx; None if it is not installed."""
    return shutil.which("ccx")


def solve(deck: Path, seconds: float) -> None:
    """Run ccx on a deck; its results lie beside it.

    Raises
    ------
    MissingError
        If ccx is not installed.
    RuntimeError
        If it did not reach the end.
    subprocess.TimeoutExpired
        If it takes longer than so many seconds.
    """
    ccx = program()
    if ccx is None:
        raise MissingError("ccx, CalculiX's solver, is not installed; apt install calculix-ccx")
    command = [ccx, deck.stem]
    done = subprocess.run(command, cwd=deck.parent, capture_output=True, text=True, timeout=seconds, check=False)
    if done.returncode != 0 or "Job finished" not in done.stdout:
        raise RuntimeError(f"ccx ended with {done.returncode}: {' '.join(done.stdout[-_SAID:].split())}")


def printed_forces(path: Path) -> tuple[Float, Float]:
    """Return the times (n,) and the forces (n, 3), N, on the meshed part from the .dat file of a run.

    A step lasts from one whole number to the next.
    """
    found = _TOTAL.findall(path.read_text(encoding="ascii", errors="replace"))
    table = np.array([[float(value) for value in row] for row in found]).reshape(-1, 4)
    return table[:, 0], table[:, 1:]
