"""Does a press at large deformation agree with CalculiX, an independent code?

The Fig. 9 finger in plane strain, nu = 0.45, mu = 0.25, is pressed 10 mm by a flat plate.  Both codes use the same mesh
of quadratic triangles and the same law, W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2 (*HYPERELASTIC, NEO HOOKE with D1 =
2/K; *STATIC with NLGEOM), and each its own contact: CalculiX a face-to-face penalty with friction (100 and 10 MPa/mm),
finger3d multipliers at the vertices.  CalculiX runs only where it is installed (Debian: calculix-ccx). Otherwise, and
in the quick version, the force is compared with the one that CalculiX 2.20 gave for this study
(validation/REFERENCES.md, 6.5), and the rows say so.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.analyses.calculix.deck import Contact
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure

from ._ccx import program
from ._ccx import run as run_calculix
from ._press import converged, fig9_finger
from ._rows import Result, Row

NU, MU, WIDTH = 0.45, 0.25, 20.0
DEPTHS = (5.0, 10.0)
SIZES = (4.0, 2.0)
KEPT = {
    4.0: (8.81694, 28.5524),
    2.0: (8.80263, 28.4931),
}  # N per mm at DEPTHS by mesh, CalculiX 2.20: this study in full
REASON = "two contact formulations, penalty and multipliers; 0.3 % or less measured"
PENALTY = 100.0  # MPa/mm: under 1 MPa the surfaces overlap by 0.01 mm, 1e-3 of the depth
STICK = 10.0  # MPa/mm: friction of 0.1 MPa takes 0.01 mm; ten times as stiff, CalculiX does not settle
_SECONDS = 900.0  # a busy machine: 100 s on a quiet one


def problem(size: float) -> Problem:
    """The finger as half a section."""
    mesh, legs = MeshOptions(size, 4.0 * size, "swept"), (Leg(10.0, steps=10),)
    model = Model(fig9_finger(), Isotropic(1.0, NU), mesh, legs, friction=Coulomb(MU), domain="plane-strain")
    return build(Effect().apply(model))


def pressed(body: Problem) -> np.ndarray:
    """Depth (mm) and force (N per mm width) (10, 2) of this code."""
    frames = converged(body)
    return np.array([(f.target.depth_mm, measure(body.points, f)["normal_force_N"] / WIDTH) for f in frames])


def run(quick: bool) -> Result:
    """Meshes of 4 and 2 mm; quick: of 4 mm, against the number kept."""
    rows: list[Row] = []
    table: dict[str, list[Any]] = {"size_mm": [], "depth_mm": [], "calculix": [], "finger3d": []}
    curves = {}
    for size in SIZES[:1] if quick else SIZES:
        body = problem(size)
        curves[size] = pressed(body)
        other, source = np.array(KEPT[size]), "CalculiX 2.20, same mesh and law, numbers kept"
        if not quick and program():
            legs = tuple(Leg(depth, steps=4) for depth in DEPTHS)
            answer = run_calculix(replace(body.model, legs=legs), Contact(PENALTY, STICK, MU), _SECONDS)
            other = answer.forces[:, 1] / WIDTH
            source = "CalculiX, same mesh and law, run for this"
        for depth, theirs in zip(DEPTHS, other, strict=True):
            ours = float(np.interp(depth, *curves[size].T))
            for key, value in zip(table, (size, depth, float(theirs), ours), strict=True):
                table[key].append(value)
            what = f"force at {depth:g} mm, mesh of {size:g} mm, N per mm"
            rows.append(Row(what, source, float(theirs), ours, 0.02, REASON, "validation"))
    return Result(tuple(rows), table, lambda figure: _draw(figure, curves, table))


def _draw(figure: Any, curves: dict[float, np.ndarray], table: dict[str, list[Any]]) -> None:
    left, right = figure.subplots(1, 2)
    size, depth, theirs, ours = (np.array(table[key]) for key in table)
    for k, (h, curve) in enumerate(curves.items()):
        here = size == h
        left.plot(*curve.T, f"C{k}-", label=f"finger3d, mesh of {h:g} mm")
        left.plot(depth[here], theirs[here], f"C{k}o", mfc="none", label=f"CalculiX, mesh of {h:g} mm")
        right.plot(depth[here], 100.0 * (ours[here] / theirs[here] - 1.0), f"C{k}o-", label=f"mesh of {h:g} mm")
    left.set(xlabel="depth, mm", ylabel="force, N per mm width")
    right.set(xlabel="depth, mm", ylabel="finger3d over CalculiX - 1, %", ylim=(-2.5, 2.5))
    right.axhspan(-2.0, 2.0, color="0.92", label="tolerance: 2 %")
    right.axhline(0.0, color="k", lw=0.6)
