"""CalculiX input decks of finger3d meshes, one run, and the force, friction and time that it reports.

Surface-to-surface penalty contact under a flat plate whose nodes are all moved.  Sources: CalculiX
CrunchiX user's manual 2.20, sec. 6.2 (elements), 6.7.8 (contact), 7 (cards).
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from finger3d.analyses.calculix.deck import facet_lines
from finger3d.analyses.calculix.run import program
from finger3d.fem.simplex import Mesh

Int = NDArray[np.int64]

# MPa/mm, under pressures of .2 MPa: of those tried on the coarsest solid (100 and 10, 20 and 5, 20 and 2) the quickest,
# with the force nearest to ours.  At 2000 it diverged.
PENALTY, STICK_SLOPE = 20.0, 5.0
_BEYOND = 10.0  # mm by which the plate reaches beyond the finger


def version() -> str:
    """Its version, as it says."""
    said = subprocess.run([str(program()), "-v"], capture_output=True, text=True, check=False).stdout
    found = re.search(r"[Vv]ersion\s+([\w.]+)", said)
    return found.group(1) if found else "unknown"


@dataclass(frozen=True)
class Pressed:
    """A press: a quadratic mesh of the part, constants, depth (mm), and the planes that mirror it.

    `finite` is for finite strain and the neo-Hookean law with D1 = 2/K; `labels` are the faces that may touch the
    plate, `penalty` and `stick` the stiffnesses of contact and friction, MPa/mm.
    """

    mesh: Mesh
    E_MPa: float
    nu: float
    mu: float
    depth_mm: float
    steps: int
    thickness_mm: float
    axes: tuple[str, ...]
    finite: bool = False
    labels: tuple[str, ...] = ("contact",)
    penalty: float = PENALTY
    stick: float = STICK_SLOPE

    @property
    def law(self) -> list[str]:
        """Cards of the material."""
        if not self.finite:
            return ["*ELASTIC", f"{self.E_MPa:g}, {self.nu:g}"]
        shear, bulk = self.E_MPa / (2.0 * (1.0 + self.nu)), self.E_MPa / (3.0 * (1.0 - 2.0 * self.nu))
        return ["*HYPERELASTIC, NEO HOOKE", f"{shear / 2.0:.12g}, {2.0 / bulk:.12g}"]


@dataclass(frozen=True)
class Answer:
    """What one run gave: forces (N) on the whole finger, friction positive outward; seconds, MB, counts."""

    force: float
    outward_x: float
    outward_z: float
    wall: float
    cpu: float
    peak_mb: float
    iterations: int
    increments: int


# a small process between: the peak of its children is then that of ccx alone
_LAUNCH = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
with open("press.log", "w") as log:
    status = subprocess.run(sys.argv[1:], stdout=log, stderr=subprocess.STDOUT).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([status, time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024]))
"""


def run(press: Pressed, folder: Path, limit_s: float) -> Answer:
    """Write the input, run ccx, and read what it printed.

    Raises
    ------
    ArithmeticError
        It did not reach the end.
    subprocess.TimeoutExpired
        Not within the limit.
    """
    (folder / "press.inp").write_text(deck(press), encoding="ascii")
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", _LAUNCH, str(program()), "press"], cwd=folder, capture_output=True,
        text=True, timeout=limit_s, check=True,
    )  # fmt: skip
    status, wall, cpu, peak = json.loads(done.stdout)
    log = (folder / "press.log").read_text(encoding="utf-8", errors="replace")
    if status != 0 or "Job finished" not in log:
        raise ArithmeticError(f"ccx ended with {status}: {' '.join(log.split()[-20:])}")
    history = [line.split() for line in (folder / "press.sta").read_text(encoding="ascii").splitlines()[2:]]
    x, y, z = _total(folder / "press.dat")
    share = 2.0 ** len(press.axes)
    return Answer(
        -share * y, share * x, share * z, wall, cpu, peak, sum(int(h[3]) for h in history), len(history)
    )  # fmt: skip


def _total(path: Path) -> tuple[float, float, float]:
    """Force (N) that moves the plate, at the end; by the balance of the plate it is the force on the finger's part."""
    lines = path.read_text(encoding="ascii").splitlines()
    last = max(i for i, line in enumerate(lines) if "total force (fx,fy,fz) for set NPLATE" in line)
    x, y, z = map(float, lines[last + 2].split())
    return x, y, z


def deck(press: Pressed) -> str:
    """The input file."""
    mesh, d = press.mesh, press.mesh.dim
    n, e = len(mesh.points), len(mesh.cells)
    lines = ["*NODE, NSET=NALL"]
    lines += [f"{i}, " + ", ".join(f"{x:.12g}" for x in (*p, 0.0)[:3]) for i, p in enumerate(mesh.points, start=1)]
    plate, kind = _plate(press, n)
    lines += ["*NODE, NSET=NPLATE"]
    lines += [f"{n + i}, " + ", ".join(f"{x:.12g}" for x in p) for i, p in enumerate(plate, start=1)]
    lines += [f"*ELEMENT, TYPE={'C3D10' if d == 3 else 'CPE6'}, ELSET=BODY"]
    lines += [f"{i}, " + ", ".join(map(str, c + 1)) for i, c in enumerate(mesh.cells, start=1)]
    lines += [
        f"*ELEMENT, TYPE={kind}, ELSET=PLATE",
        f"{e + 1}, " + ", ".join(str(n + k + 1) for k in range(len(plate))),
    ]
    section = [f"{press.thickness_mm:g}"] if d == 2 else []
    lines += [
        "*MATERIAL, NAME=RUBBER", *press.law,
        "*MATERIAL, NAME=PLATE", "*ELASTIC", "1000., 0.",
        "*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER", *section,
        "*SOLID SECTION, ELSET=PLATE, MATERIAL=PLATE", *section,
        "*SURFACE, NAME=FINGER, TYPE=ELEMENT", *facet_lines(mesh, press.labels),
        "*SURFACE, NAME=UNDER, TYPE=ELEMENT", f"{e + 1}, S1",
        "*SURFACE INTERACTION, NAME=TOUCH",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{press.penalty:g}",
        *(["*FRICTION", f"{press.mu:g}, {press.stick:g}"] if press.mu else []),
        "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "FINGER, UNDER",
        "*BOUNDARY", *_held(press, n, len(plate)),
        f"*STEP, INC={10 * press.steps}" + ", NLGEOM" * press.finite,
        "*STATIC", f"{1.0 / press.steps:.12g}, 1., 1e-5, {1.0 / press.steps:.12g}",
        "*BOUNDARY", f"NPLATE, 2, 2, {-press.depth_mm:g}",
        "*NODE PRINT, NSET=NPLATE, FREQUENCY=1, TOTALS=ONLY", "RF",
        "*END STEP",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _plate(press: Pressed, first: int) -> tuple[list[tuple[float, float, float]], str]:
    """Corners of one large element above the finger, its first face the lower one, and its type."""
    low, high = press.mesh.points.min(axis=0), press.mesh.points.max(axis=0)
    x0, x1 = low[0] - _BEYOND, high[0] + _BEYOND
    y, top = high[1], high[1] + 10.0
    if press.mesh.dim == 2:
        return [(x0, y, 0.0), (x1, y, 0.0), (x1, top, 0.0), (x0, top, 0.0)], "CPE4"
    z0, z1 = low[2] - _BEYOND, high[2] + _BEYOND
    # S1 is nodes 1-2-3-4; z to x to y is right-handed, so that nodes 5-8 are above them
    under = [(x0, y, z0), (x0, y, z1), (x1, y, z1), (x1, y, z0)]
    return [*under, *[(x, top, z) for x, _, z in under]], "C3D8"


def _held(press: Pressed, n: int, plate: int) -> list[str]:
    mesh = press.mesh
    lines = [f"{i + 1}, 1, 3" for i in np.unique(mesh.facets["base"])]
    base = set(np.unique(mesh.facets["base"]).tolist())
    for axis in press.axes:
        k = "xyz".index(axis) + 1
        lines += [f"{i + 1}, {k}, {k}" for i in np.unique(mesh.facets["symmetry_" + axis]) if i not in base]
    lines += [f"{n + i}, {k}, {k}" for i in range(1, plate + 1) for k in (1, 3)]
    return lines
