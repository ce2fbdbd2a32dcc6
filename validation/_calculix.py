"""The Fig. 9 finger as an input deck of CalculiX, and the reader of its results."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from finger3d.analyses.calculix.deck import facet_lines
from finger3d.analyses.calculix.run import program
from finger3d.fem.simplex import Mesh

Float = NDArray[np.float64]

_PENALTY = 100.0  # MPa/mm: under 1 MPa the surfaces overlap by 0.01 mm, 1e-3 of the depth
_STICK = 10.0  # MPa/mm: friction of 0.1 MPa takes 0.01 mm; ten times as stiff, CalculiX does not settle
_PLATE = 4.0  # mm


def deck(mesh: Mesh, E: float, nu: float, mu: float, depths: list[float], finite: bool) -> str:
    """Input of a half section, 1 mm thick, under a flat plate; one step for each depth (mm).

    Finite: neo-Hookean with D1 = 2/K, which is W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2; else linear elastic.  The
    contact is CalculiX's face to face penalty.
    """
    n, count = len(mesh.points), len(mesh.cells)
    top, reach = mesh.points[:, 1].max(), mesh.points[:, 0].max() + 10.0
    plate = [(-1.0, top), (reach, top), (reach, top + _PLATE), (-1.0, top + _PLATE)]
    points = [*map(tuple, mesh.points), *plate]
    lines = ["*NODE, NSET=ALL"] + [f"{i}, {x:.12g}, {y:.12g}, 0." for i, (x, y) in enumerate(points, 1)]
    lines += ["*ELEMENT, TYPE=CPE6, ELSET=BODY"]
    lines += [f"{e}, " + ", ".join(str(k + 1) for k in cell) for e, cell in enumerate(mesh.cells, 1)]
    lines += ["*ELEMENT, TYPE=CPE4, ELSET=PLATE", f"{count + 1}, {n + 1}, {n + 2}, {n + 3}, {n + 4}"]
    lines += ["*NSET, NSET=BASE", *map(str, np.unique(mesh.facets["base"]) + 1)]
    lines += ["*NSET, NSET=MIDDLE", *map(str, np.unique(mesh.facets["symmetry_x"]) + 1)]
    lines += ["*NSET, NSET=PLATEN", *(str(n + k) for k in range(1, 5))]
    lines += ["*SURFACE, NAME=DOME, TYPE=ELEMENT", *facet_lines(mesh, ("contact",))]
    lines += ["*SURFACE, NAME=FLAT, TYPE=ELEMENT", f"{count + 1}, S1"]
    shear, bulk = E / (2.0 * (1.0 + nu)), E / (3.0 * (1.0 - 2.0 * nu))
    law = (
        ["*HYPERELASTIC, NEO HOOKE", f"{shear / 2.0:.12g}, {2.0 / bulk:.12g}"] if finite else ["*ELASTIC", f"{E}, {nu}"]
    )
    lines += ["*MATERIAL, NAME=SILICONE", *law, "*MATERIAL, NAME=HARD", "*ELASTIC", "1000., 0.3"]
    lines += ["*SOLID SECTION, ELSET=BODY, MATERIAL=SILICONE", "1.", "*SOLID SECTION, ELSET=PLATE, MATERIAL=HARD", "1."]
    lines += ["*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{_PENALTY:g}"]
    lines += ["*FRICTION", f"{mu}, {_STICK:g}"]
    lines += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "DOME, FLAT"]
    lines += ["*BOUNDARY", "BASE, 1, 2", "MIDDLE, 1, 1"]
    for depth in depths:
        lines += ["*STEP, INC=1000" + (", NLGEOM" if finite else ""), "*STATIC", "0.1, 1., 1e-5, 0.25"]
        lines += ["*BOUNDARY", "PLATEN, 1, 1, 0.", f"PLATEN, 2, 2, {-depth:.12g}"]
        lines += ["*NODE PRINT, NSET=BASE, TOTALS=ONLY, FREQUENCY=1000", "RF", "*END STEP"]
    return "\n".join(lines) + "\n"


def solve(text: str, folder: Path, seconds: float) -> Float:
    """Force (steps,) N per mm width of the whole section, after each step."""
    (folder / "press.inp").write_text(text)
    done = subprocess.run(
        [program() or "ccx", "press"], cwd=folder, capture_output=True, text=True, timeout=seconds, check=False
    )
    found = (folder / "press.dat").read_text() if (folder / "press.dat").exists() else ""
    number = r"([-+]?\d\.\d+E[-+]\d+)"
    totals = re.findall(rf"total force.*?\n\s*\n\s*{number}\s+{number}\s+{number}", found)
    steps = text.count("*END STEP")
    if len(totals) != steps:
        raise RuntimeError(f"CalculiX reached {len(totals)} of {steps} steps: {done.stdout[-300:]}")
    return np.array([2.0 * abs(float(t[1])) for t in totals])
