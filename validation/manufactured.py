"""Do displacement and pressure converge at the rates of quadratic elements for every Poisson's ratio, 1/2 included?

Source: the manufactured solutions of validation/REFERENCES.md, 5.2, free of divergence so that they hold for every nu.
In the mixed form a pressure sin 2px cos py, p = pi, is added through the body force at nu = 1/2.

Expected rates: Ciarlet 1978 (3 in L2 and 2 in H1 for quadratic elements); Boffi, Brezzi and Fortin 2013, sec. 8.8
(Taylor-Hood: the same, and 2 for the pressure).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import quadratic

from ._common import body_load, convergence, cube, error_norms, held_at, pressure_error, rate, solve
from ._rows import Result, exact_columns, listed

judged = listed(__file__)

PI = np.pi
NUS = (0.3, 0.49, 0.4999, 0.5)


def exact(p: Float) -> Float:
    """Displacement (n, d) at points (n, d)."""
    s = np.sin(PI * p)
    if p.shape[1] == 2:
        return s[:, ::-1]
    return np.stack([s[:, 1] * s[:, 2], s[:, 2] * s[:, 0], s[:, 0] * s[:, 1]], axis=1)


def slope(p: Float) -> Float:
    """Its gradient (n, d, d), first index the component."""
    s, c = np.sin(PI * p), PI * np.cos(PI * p)
    d = p.shape[1]
    out = np.zeros((len(p), d, d))
    if d == 2:
        out[:, 0, 1], out[:, 1, 0] = c[:, 1], c[:, 0]
        return out
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[:, i, j], out[:, i, k] = c[:, j] * s[:, k], s[:, j] * c[:, k]
    return out


def pressure(p: Float) -> Float:
    """Pressure (n,) at points (n, d), mean zero; used at nu = 1/2, where it is free of the displacement."""
    return np.sin(2 * PI * p[:, 0]) * np.cos(PI * p[:, 1])


def pressure_slope(p: Float) -> Float:
    """Its gradient (n, d)."""
    out = np.zeros_like(p)
    out[:, 0] = 2 * PI * np.cos(2 * PI * p[:, 0]) * np.cos(PI * p[:, 1])
    out[:, 1] = -PI * np.sin(2 * PI * p[:, 0]) * np.sin(PI * p[:, 1])
    return out


def errors(dim: int, count: int, nu: float) -> tuple[float, float, float]:
    """L2 and H1 errors of the displacement, L2 error of the pressure (nan in the displacement form)."""
    mesh = quadratic(cube(dim, count))
    elastic = Elasticity.of(1.0, nu)
    share = float(nu == 0.5)
    load = body_load(mesh, lambda p: (dim - 1) * PI**2 * elastic.shear * exact(p) - share * pressure_slope(p))
    held = held_at(mesh, {side: range(dim) for side in mesh.facets})
    found = solve(mesh, elastic, held, exact(mesh.points), load)
    l2, h1 = error_norms(mesh, found.u, exact, slope)
    if not elastic.mixed:
        return l2, h1, np.nan
    # the mean of p follows from the held boundary's round-off at nu = 1/2: compare without it
    away = found.pressure - _mean(mesh, found.pressure)
    return l2, h1, pressure_error(mesh, away, lambda p: share * pressure(p))


def _mean(mesh: Any, values: Float) -> float:
    lift = pressure_error(mesh, values + 1.0, lambda p: np.zeros(len(p))) ** 2
    drop = pressure_error(mesh, values - 1.0, lambda p: np.zeros(len(p))) ** 2
    return (lift - drop) / 4.0  # the cube's volume is 1


def run(quick: bool) -> Result:
    """Answer the question."""
    counts = {2: (4, 8, 16), 3: (2, 4, 6)} if quick else {2: (8, 16, 32, 64), 3: (3, 5, 10)}
    nus = {2: NUS, 3: (0.3, 0.5)} if quick else {2: NUS, 3: NUS}
    found = {(d, nu): np.array([errors(d, n, nu) for n in counts[d]]) for d in (2, 3) for nu in nus[d]}
    rows = []
    for d in (2, 3):
        sizes = 1.0 / np.array(counts[d])
        slopes = np.array([[rate(sizes[-2:], e) for e in found[d, nu][-2:].T] for nu in nus[d]])

        for column, name, wanted in ((0, "displacement, L2", 3.0), (1, "gradient, L2", 2.0), (2, "pressure, L2", 2.0)):
            # at nu < 1/2 the exact pressure is 0, and its error that of the displacement's divergence
            got = slopes[:, column].min() if column < 2 else slopes[-1, 2]
            which = "lowest over nu" if column < 2 else "nu = 0.5"
            words = {"name": name, "dim": d, "which": which, "coarse": counts[d][-2], "fine": counts[d][-1]}
            rows.append(judged("rate", got, wanted, **words))
        growth = max(found[d, nu][-1, 0] / found[d, 0.3][-1, 0] for nu in nus[d])
        rows.append(judged("no-locking", growth, dim=d))
    flat = [(d, nu, n, *values) for (d, nu), e in found.items() for n, values in zip(counts[d], e, strict=True)]
    names = "dim nu cells_per_side displacement_L2 gradient_L2 pressure_L2"
    return Result(tuple(rows), exact_columns(names, flat), lambda f: draw(f, found, counts))


def draw(figure: Any, found: dict[tuple[int, float], Float], counts: dict[int, tuple[int, ...]]) -> None:
    """Errors over the cell size, 2D and 3D; curves of all nu lie on each other, so two of them are drawn."""
    for d, axes in zip((2, 3), figure.subplots(1, 2), strict=True):
        sizes = 1.0 / np.array(counts[d])
        for column, wanted, kind in ((1, 2.0, "gradient of u"), (0, 3.0, "u")):
            curves = {f"{kind}, nu = {nu:g}": found[d, nu][:, column] for nu in (0.3, 0.5)}
            if column == 1:
                curves["pressure, nu = 0.5"] = found[d, 0.5][:, 2]
            convergence(axes, sizes, curves, wanted, "cell size / side", "L2 error (mm, MPa), unit cube, E = 1 MPa")
        axes.set_ylim(bottom=found[d, 0.3][-1, 0] / 100.0)
        axes.set_title(f"{d}D, quadratic elements, mixed from nu = 0.48")
