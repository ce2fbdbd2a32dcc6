"""Does a rigid punch with a flat end press a deep block as the closed form says, away from its corners?

Source: validation/REFERENCES.md, 1.5 (Johnson 1985, sec. 2.8): frictionless, plane strain, p = P/(pi sqrt(a^2 - x^2)),
infinite at the corners.  The block is 200 a deep, with contact points for |x| <= a.  Nodal pressures are compared for
|x| <= 0.9 a at the same total force.  The first element at the corner is h long, the next ones grow.

Expected rate: the point at the corner also represents half an element beyond it, which makes the punch wider by a
fraction of h.  So the error is of first order in h, and of one sign everywhere but in the last few elements.
"""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity

from ._common import body, box, convergence, graded, held_at, mapped, rate
from ._rows import Result, exact_columns, listed

judged = listed(__file__)

HEIGHT = 200.0  # a = 1 mm, E = 1 MPa
AWAY = 0.9


def pressures(h: float, nu: float, depth: float = 1e-3) -> tuple[Float, Float, Float]:
    """Places x (n,) in mm, pressures (n,) in MPa and forces (n,) in N under half a punch; corner elements of `h` mm."""
    inner, outer, down = graded(1.0, h, 1.2), graded(HEIGHT - 1.0, h, 1.5), graded(HEIGHT, h, 1.4)
    x = np.concatenate([1.0 - inner[::-1], 1.0 + outer[1:]])
    mesh = mapped(box([x, HEIGHT - down[::-1]]), lambda p: p)
    held = held_at(mesh, {"x-": [0], "y-": [0, 1]})
    block = body(mesh, Elasticity.of(1.0, nu), held, "y+", lambda p: p[:, 0] < 1.0 + 1e-9)
    order = np.argsort(block.surface.points[:, 0])
    force = block.normal_force(np.full(len(order), -depth))[order]
    return block.surface.points[order, 0], force / block.surface.area[order], force


def exact(x: Float, force: float) -> Float:
    """Pressure (MPa) at |x| < 1 mm under a punch with the whole force in N per mm."""
    return force / (np.pi * np.sqrt(1.0 - x**2))


def errors(h: float, nu: float) -> tuple[float, float, float, float]:
    """Length of the corner's element over a; relative errors of the pressure up to 0.9 a (largest, root mean square)
    and of the force within a/2."""
    x, p, force = pressures(h, nu)
    whole = 2.0 * float(force.sum())
    near = x <= AWAY
    away = p[near] / exact(x[near], whole) - 1.0
    fine = np.linspace(0.0, 0.5, 2001)
    half = float(np.trapezoid(np.interp(fine, x, p), fine))
    return float(x[-1] - x[-2]), float(np.abs(away).max()), float(np.sqrt(np.mean(away**2))), half / (whole / 6.0) - 1.0


def run(quick: bool) -> Result:
    """Two Poisson's ratios, three sizes or more."""
    sizes = np.array([0.02, 0.01, 0.0025] if quick else [0.02, 0.01, 0.005, 0.0025, 0.00125])
    rows, table, curves = [], [], {}
    for nu in (0.3,) if quick else (0.3, 0.45):
        found = np.array([errors(h, nu) for h in sizes])
        _, worst, _, half = found[-1]
        rows += [
            judged("pressure", worst, nu=nu),
            judged("share-of-the-force", (1 + half) / 3, 1 / 3, nu=nu),
            judged("rate-of-the-share", rate(found[:, 0], found[:, 3]), nu=nu),
        ]
        curves[f"pressure up to 0.9 a, worst, nu = {nu:g}"] = found[:, 1]
        curves[f"force within a/2, nu = {nu:g}"] = found[:, 3]
        table += [(nu, *e) for e in found]
    names = "nu corner_element_over_a worst_error rms_error error_of_inner_force"
    labels = "first element at the corner / a", "relative error"
    return Result(
        tuple(rows), exact_columns(names, table), lambda f: convergence(f.subplots(), found[:, 0], curves, 1.0, *labels)
    )
