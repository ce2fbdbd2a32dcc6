"""Runs of CalculiX on decks of this package, with the forces, time and memory that each took."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from finger3d._types import Float
from finger3d.analyses.calculix import OBJECT, Contact, Deck, press_deck
from finger3d.errors import MissingError
from finger3d.mechanics.model import Model

_NUMBER = r"\s*([-+]?\d\.\d+E[-+]\d+)"
_TOTAL = re.compile(rf"total force \(fx,fy,fz\) for set {OBJECT} and time\s+(\S+)\s+{_NUMBER}{_NUMBER}{_NUMBER}")
INSTALL = "apt install calculix-ccx"
_SAID = 300  # last characters of what it said, in a message


def program() -> str | None:
    """Return the path of ccx; None if it is not installed."""
    return shutil.which("ccx")


# a small process between: the peak of its children is then that of ccx alone
_LAUNCH = """
import json, resource, subprocess, sys, time
limit, *command = sys.argv[1:]
start = time.perf_counter()
with open(command[1] + ".log", "w") as log:
    try:
        status = subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, timeout=float(limit)).returncode
    except subprocess.TimeoutExpired:  # which has ended ccx
        status = None
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([status, time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024]))
"""


def solve(deck: Path, seconds: float) -> tuple[float, float, float]:
    """Run ccx on a deck, beside which its results lie; return its wall and processor time (s) and its peak (MB).

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
        raise MissingError(f"ccx, CalculiX's solver, is not installed; {INSTALL}")
    command = [sys.executable, "-I", "-S", "-c", _LAUNCH, str(seconds), ccx, deck.stem]
    done = subprocess.run(command, cwd=deck.parent, capture_output=True, text=True, check=True)
    status, wall, cpu, peak = json.loads(done.stdout)
    if status is None:
        raise subprocess.TimeoutExpired(command, seconds)
    log = deck.with_suffix(".log").read_text(encoding="utf-8", errors="replace")
    if status != 0 or "Job finished" not in log:
        raise RuntimeError(f"ccx ended with {status}: {' '.join(log[-_SAID:].split())}")
    return wall, cpu, peak


def printed_forces(path: Path) -> tuple[Float, Float]:
    """Return the times (n,) and the forces (n, 3), N, on the meshed part from the .dat file of a run.

    A step lasts from one whole number to the next.
    """
    found = _TOTAL.findall(path.read_text(encoding="ascii", errors="replace"))
    table = np.array([[float(value) for value in row] for row in found]).reshape(-1, 4)
    return table[:, 0], table[:, 1:]


def version() -> str:
    """Its version, as it says."""
    said = subprocess.run([str(program()), "-v"], capture_output=True, text=True, check=False).stdout
    found = re.search(r"[Vv]ersion\s+([\w.]+)", said)
    return found.group(1) if found else "unknown"


@dataclass(frozen=True)
class Answer:
    """What one run gave: forces (steps, 3) N on the whole finger after each step, friction positive outward.

    Seconds, MB, and counts are those of the run.
    """

    forces: Float
    wall: float
    cpu: float
    peak_mb: float
    iterations: int
    increments: int

    @property
    def force(self) -> float:
        """Normal force (N) at the end."""
        return float(self.forces[-1, 1])


def run(model: Model, limit_s: float, contact: Contact | None = None) -> Answer:
    """Press a model by ccx, with a penalty contact of its own if one is given, and read what it printed.

    Raises
    ------
    RuntimeError, subprocess.TimeoutExpired
        See `solve`.
    """
    made = press_deck(model)
    with _written(made, contact) as path:
        spent = solve(path, limit_s)
        history = [line.split() for line in path.with_suffix(".sta").read_text(encoding="ascii").splitlines()[2:]]
        times, forces = printed_forces(path.with_suffix(".dat"))
    ends = [int((times <= k + 1e-6).sum()) - 1 for k in range(1, len(made.steps) + 1)]
    whole = made.multiple * forces[ends] * [1.0, -1.0, 1.0]
    return Answer(whole, *spent, sum(int(h[3]) for h in history), len(history))


def share_done(model: Model, limit_s: float, stiffer: float) -> float:
    """Share of a press of one step that ccx has done at its end, with a stick slope so many times that of the deck."""
    deck = press_deck(model)
    with _written(deck, replace(deck.contact, stick=stiffer * deck.contact.stick)) as path:
        with suppress(RuntimeError):  # it gave up, which is what is measured: the forces printed say how far it came
            solve(path, limit_s)
        times, _ = printed_forces(path.with_suffix(".dat"))
    return float(times[-1]) if len(times) else 0.0


@contextmanager
def _written(deck: Deck, contact: Contact | None) -> Iterator[Path]:
    """Write a deck without fields, with another contact if one is given, into a folder of its own for a while."""
    with tempfile.TemporaryDirectory(prefix="finger3d_ccx_") as folder:
        path = Path(folder, "press.inp")
        path.write_text(replace(deck, contact=contact or deck.contact, fields=False).text(), encoding="ascii")
        yield path
