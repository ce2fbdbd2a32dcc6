"""Does a tube under inner pressure widen as Lame says, with curved cells, at the rates of quadratic elements?

Source: Lame 1852 (Timoshenko and Goodier 1970, sec. 28), validation/REFERENCES.md, 5.6: inner radius a = 1, outer
radius b = 2, pressure p = 1, E = 1.  In plane stress nu/(1 + nu) takes the place of nu at equal G.  In 3D a slice of
the tube with held faces is solved.

Expected rates: 3 in L2 and 2 in H1, also for isoparametric curved cells (Ciarlet and Raviart 1972).  The mean of u(a)
is proportional to the work of the load, whose error is that of the energy, rate 4.

At nu = 1/2 the code limits lam/G to 1e7, which changes u by 1e-7.  Errors and rates are taken against the closed form
for that lam, because they would level off otherwise; u(a) itself is compared with the value for nu = 1/2.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity

from ._common import box, convergence, error_norms, held_at, mapped, rate, side_load, solve
from ._rows import Result, exact_columns, listed

judged = listed(__file__)
KINDS = ("displacement, L2", "gradient, L2", "u(a)")
SOURCES = ("Ciarlet and Raviart 1972", "Ciarlet and Raviart 1972", "twice the energy's norm")
CASES = ((0.3, True), (0.3, False), (0.49, False), (0.4999, False), (0.5, False))


def coefficients(elastic: Elasticity) -> tuple[float, float]:
    """(k, m) of u(r) = k r + m / r."""
    return 1.0 / (6.0 * (elastic.lame + elastic.shear)), 4.0 / (6.0 * elastic.shear)


def widening(nu: float, plane_stress: bool) -> float:
    """u(a) in closed form (mm)."""
    return (1.0 + nu) / 3.0 * (5.0 - 2.0 * nu if not plane_stress else (1.0 - nu) / (1.0 + nu) + 4.0)


def quarter(p: Float) -> Float:
    """Quarter of the tube from the unit square (radius, angle); z, if any, stays."""
    out = p.copy()
    out[:, 0] = (1.0 + p[:, 0]) * np.cos(0.5 * np.pi * p[:, 1])
    out[:, 1] = (1.0 + p[:, 0]) * np.sin(0.5 * np.pi * p[:, 1])
    return out


def errors(dim: int, count: int, nu: float, plane_stress: bool) -> tuple[float, float, float]:
    """Errors: of u in L2, of its gradient in L2, and u(a) as the mean over the inner face."""
    sides = [np.linspace(0.0, 1.0, count + 1)] * 2 + ([np.array([0.0, 1.0 / count])] if dim == 3 else [])
    mesh = mapped(box(sides), quarter)
    elastic = Elasticity.of(1.0, nu, plane_stress)
    k, m = coefficients(elastic)
    turn = np.zeros((dim, dim))
    turn[[0, 1], [0, 1]] = 1.0

    def exact(p: Float) -> Float:
        square = (p[:, :2] ** 2).sum(axis=1)
        return (k + m / square)[:, None] * (p @ turn)

    def slope(p: Float) -> Float:
        square = (p[:, :2] ** 2).sum(axis=1)[:, None, None]
        radial = p @ turn
        return (k + m / square) * turn - 2.0 * m / square**2 * radial[:, :, None] * radial[:, None, :]

    load = side_load(mesh, "x-", lambda p: p @ turn / np.linalg.norm(p[:, :2], axis=1)[:, None])
    held = held_at(mesh, {"y-": [1], "y+": [0]} | ({"z-": [2], "z+": [2]} if dim == 3 else {}))
    u = solve(mesh, elastic, held, 0.0, load).u
    thickness = 1.0 / count if dim == 3 else 1.0
    mean = float((load * u).sum() / (0.5 * np.pi * thickness))
    scale = thickness**-0.5
    l2, h1 = error_norms(mesh, u, exact, slope)
    return l2 * scale, h1 * scale, mean


def run(quick: bool) -> Result:
    """Three sizes and more of the section, three of the slice."""
    counts = {2: (4, 8, 16), 3: (2, 4, 8)} if quick else {2: (8, 16, 32, 64), 3: (4, 8, 16)}
    rows, table = [], []
    curves: dict[int, dict[str, Float]] = {2: {}, 3: {}}
    for dim in (2, 3):
        slopes = []
        for nu, plane_stress in CASES:
            if dim == 3 and (plane_stress or (quick and nu in (0.49, 0.4999))):
                continue
            found = np.array([errors(dim, n, nu, plane_stress) for n in counts[dim]])
            name = f"{dim}D, {'plane stress' if plane_stress else 'plane strain'}, nu = {nu:g}"
            table += [(dim, nu, plane_stress, n, *e) for n, e in zip(counts[dim], found, strict=True)]
            away = np.abs(found[:, 2] / sum(coefficients(Elasticity.of(1.0, nu, plane_stress))) - 1.0)
            measured = np.column_stack([found[:, :2], away])
            curves[dim][f"nu = {nu:g}{', plane stress' if plane_stress else ''}"] = measured
            slopes.append([rate(1.0 / np.array(counts[dim][-2:]), e) for e in measured[-2:].T])
            rows.append(judged("widening", found[-1, 2], widening(nu, plane_stress), name=name))
        worst = np.min(slopes, axis=0)
        for kind, source, theory, got in zip(KINDS, SOURCES, (3.0, 2.0, 4.0), worst, strict=True):
            rows.append(judged("rate", got, theory, kind=kind, dim=dim, source=source))
    names = "dim nu plane_stress cells_per_side displacement_L2 gradient_L2 widening_mm"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, counts, curves))


def draw(figure: Any, counts: dict[int, tuple[int, ...]], curves: dict[int, dict[str, Float]]) -> None:
    """Errors over the cell size."""
    for dim, axes in zip((2, 3), figure.subplots(1, 2), strict=True):
        sizes = 1.0 / np.array(counts[dim])
        for column, kind, theory in ((1, "gradient of u", 2.0), (0, "u", 3.0), (2, "u(a)", 4.0)):
            chosen = {
                f"{kind}, {name}": e[:, column] for name, e in curves[dim].items() if name in ("nu = 0.3", "nu = 0.5")
            }
            convergence(axes, sizes, chosen, theory, "cell size / wall", "error (L2 norms; u(a) relative)")
        axes.set_ylim(bottom=axes.get_ylim()[0] / 1e4)
        axes.legend(fontsize=7, ncol=2, loc="lower right")
        axes.set_title("2D, plane strain" if dim == 2 else "3D, slice with held faces")
