"""Does a ball pressed on a half-space with friction stick, slip and dissipate as the coupled solution says?

Source: the self-similar solution of Spence 1968 and 1975, Johnson 1985, sec. 5.4; its values are in
validation/REFERENCES.md, 2.2 and 2.3.  While a paraboloid is pressed, c/a, P/P_Hertz(depth), T/P and dissipation/(P
depth) are constants of (nu, mu).

Two computations: the contact solution alone, on rings over the exact half-space (influence functions of Johnson 1985,
ch. 3); and the whole chain in 3D, quadratic tetrahedra under a quarter of a block with contact points a/4 to a/10
apart.  The block is 50 a high; its compliance is removed by dividing by the frictionless force on the same mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from . import _halfspace, _rings
from ._halfspace import RADIUS
from ._rows import Result, Row, exact_columns

SPENCE = "Spence 1975; REFERENCES.md, 2.2"
C_OVER_A = {
    (0.0, 0.125): 0.04180, (0.0, 0.25): 0.36896, (0.0, 0.5): 0.81265, (0.0, 1.0): 0.96827,
    (0.3, 0.06): 0.02826, (0.3, 0.125): 0.34734, (0.3, 0.25): 0.82416, (0.3, 0.5): 0.98416, (0.3, 1.0): 0.99948,
}  # fmt: skip
INTEGRALS = {0.3: (1.01341, 0.18168, 1.8e-4), 0.0: (1.02718, 0.23809, 3.17e-3)}  # P/P_H(depth), T/P, D/(P depth)
FULL_STICK = {0.0: 1.052891, 0.3: 1.016213}
THREE = "first order in the spacing, since c lies between two points; 0.5 % or less measured at 10 points to a"
ONE = "0.05 % or less measured; coarser meshes must pass too"
LOST = "first order in the spacing, and the reference's last digit"
COLUMNS = "body nu mu points_per_a increments P_over_Hertz T_over_P D_over_Pd c_over_a iterations"
DEPTH = 1.0 / RADIUS  # a = 1


def hertz(nu: float) -> float:
    """Frictionless force at DEPTH, N (Johnson 1985, sec. 4.2)."""
    return 4.0 / 3.0 / (1.0 - nu**2) * np.sqrt(RADIUS) * DEPTH**1.5


def depths(count: int) -> list[float]:
    """Equal increments of the depth, that is of a^2."""
    return [DEPTH * k / count for k in range(1, count + 1)]


def run(quick: bool) -> Result:
    """Rings a/80 wide under 200 increments; tets of a/4, a/7, a/10 under 40."""
    rings, many, meshes = (40, 50, (5,)) if quick else (80, 200, (4, 7, 10))
    rows, table, found = [], [], {}
    for nu in (0.3,) if quick else (0.3, 0.0):
        body = _rings.rings(nu, round(1.1 * rings), round(1.1 * rings) / rings)
        cases = [(0.25, 40), (0.25, 50), (0.25, many), (1e6, many)]
        cases += [(mu, many) for n, mu in C_OVER_A if n == nu and mu != 0.25 and not (quick and mu > 0.2)]
        for mu, count in dict.fromkeys(cases):
            r = _rings.press(body, RADIUS, mu, depths(count))
            found["rings", nu, mu, rings, count] = np.array(
                [r.P / hertz(nu), r.T / r.P, r.D / (r.P * DEPTH), r.c / r.a, r.iterations]
            )
        for points in meshes:
            ball = _halfspace.quarter(nu, points, 20.0 if quick else 50.0)
            force = _halfspace.press(ball, 0.0, [(DEPTH, 0.0)])[-1].P
            steps = _halfspace.press(ball, 0.25, [(d, 0.0) for d in depths(40)])
            s = steps[-1]
            found["tets", nu, 0.25, points, 40] = np.array(
                [
                    s.P / force,
                    s.T / s.P,
                    s.D / (s.P * DEPTH),
                    np.sqrt(s.stick_area / s.area),
                    max(t.iterations for t in steps),
                ]
            )
        rows += [*_ring_rows(nu, found, rings, many), *_tet_rows(nu, found, rings, meshes)]
    table = [(*k, *v) for k, v in found.items()]
    return Result(tuple(rows), exact_columns(COLUMNS, table), lambda figure: _draw(figure, found, rings))


def _ring_rows(nu: float, found: dict[Any, np.ndarray], rings: int, many: int) -> Iterator[Row]:
    force, sum_, lost = INTEGRALS[nu]
    value = found["rings", nu, 0.25, rings, many]
    here = f"rings, nu = {nu:g}, mu = .25"
    yield Row(f"P/P_Hertz(depth), {here}", SPENCE, force, value[0], 0.01, ONE)
    yield Row(f"T/P, {here}", SPENCE, sum_, value[1], 0.03, THREE)
    yield Row(
              f"P/P_Hertz(depth), full stick, rings, nu = {nu:g}", "Spence 1968, full stick; REFERENCES.md, 2.3",
              FULL_STICK[nu], found["rings", nu, 1e6, rings, many][0], 0.01, ONE,
          )  # fmt: skip
    if many == 200:
        in_steps = value[2] + (value[2] - found["rings", nu, 0.25, rings, 50][2]) * 50 / (200 - 50)
        rounding = 0.5 * 10.0 ** np.floor(np.log10(lost) - (1 if nu else 2)) / lost
        yield Row(
            f"D/(P depth), {here}, extrapolated in 1/N from 50 and 200", SPENCE, lost, in_steps, 0.03 + rounding, LOST
        )
    for (case, mu), want in C_OVER_A.items():
        key = ("rings", nu, mu, rings, many)
        if case == nu and key in found:
            got = found[key][3]
            yield Row(
                      f"c/a, rings, nu = {nu:g}, mu = {mu:g}", SPENCE, want, got, 1.0 / rings, f"one ring, a/{rings}",
                      measure="absolute",
                  )  # fmt: skip


def _tet_rows(nu: float, found: dict[Any, np.ndarray], rings: int, meshes: tuple[int, ...]) -> Iterator[Row]:
    force, sum_, _ = INTEGRALS[nu]
    value = found["tets", nu, 0.25, meshes[-1], 40]
    here = f"3D, nu = {nu:g}, mu = .25, {meshes[-1]} points to a"
    yield Row(f"P/P_frictionless(depth), {here}", SPENCE, force, value[0], 0.01, ONE)
    yield Row(f"T/P, {here}", SPENCE, sum_, value[1], 0.03, THREE)
    exact = found["rings", nu, 0.25, rings, 40][2]
    if len(meshes) > 2:
        first, last = (found["tets", nu, 0.25, n, 40][2] - exact for n in (meshes[0], meshes[-1]))
        rate = np.log(first / last) / np.log(meshes[-1] / meshes[0])
        yield Row(
                  f"rate at which the excess of D falls with the mesh, 3D, nu = {nu:g}",
                  "first order in the spacing, against rings", 1.0, float(rate), 0.3,
                  "few points lie along the edge of the stick zone", measure="at least",
              )  # fmt: skip
        yield Row(
                  f"c/a, {here}", SPENCE, C_OVER_A[nu, 0.25], value[3], 1.0 / meshes[-1],
                  f"one point spacing, a/{meshes[-1]}", measure="absolute",
              )  # fmt: skip


def _draw(figure: Any, found: dict[Any, np.ndarray], rings: int) -> None:
    left, middle, right = figure.subplots(1, 3)
    for nu, colour in ((0.3, "C0"), (0.0, "C1")):
        got = {k[2]: v for k, v in found.items() if k[0] == "rings" and k[1] == nu and k[2] < 10}
        if not got:
            continue
        mus = sorted(got)
        left.semilogx(
            mus, [got[m][3] for m in mus], colour + "o", label=f"rings, nu = {nu:g}", mfc="none" if nu else None
        )
        wanted = {m: c for (n, m), c in C_OVER_A.items() if n == nu}
        left.semilogx(list(wanted), list(wanted.values()), colour + "--", label="reference")
        tets = {k[3]: v for k, v in found.items() if k[0] == "tets" and k[1] == nu}
        points = list(tets)
        for i, name, mark in ((0, "P", "o-"), (1, "T/P", "s-")):
            error = [100 * abs(tets[n][i] / INTEGRALS[nu][i] - 1) for n in points]
            middle.loglog(points, error, colour + mark, label=f"{name}, nu = {nu:g}", mfc="w" if i else None)
        exact = found["rings", nu, 0.25, rings, 40][2]
        right.loglog(points, [tets[n][2] for n in points], colour + "o-", label=f"3D, nu = {nu:g}")
        right.axhline(exact, color=colour, ls="--", lw=1, label=f"rings a/{rings} wide")
    left.set(xlabel="mu", ylabel="c/a", title="stick radius")
    middle.set(xlabel="points per a", ylabel="error, %", title="3D, mu = .25")
    right.set(xlabel="points per a", ylabel="D/(P depth), 40 increments", title="dissipation, mu = .25")
    for axes in (middle, right):
        axes.set_xticks(points, [str(n) for n in points])
        axes.set_xticks([], minor=True)
