"""Do a cylinder and a ball that are pressed with friction stick, slip and dissipate as Spence's solutions say?

Source: validation/REFERENCES.md, 2.1 to 2.4.  The cylinder lies on a half-plane, the ball on a half-space.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from finger3d.contact.friction import SLIP

from . import _halfplane, _halfspace, _rings
from ._common import ticks_at
from ._halfplane import RADIUS, Profile, compliance, line, loading, under
from ._increments import PlainCoulomb
from ._rows import Result, Row, exact_columns, grouped, listed, together

judged = listed(__file__)

C_OVER_A_LINE = {  # REFERENCES.md, 2.1, fully coupled; (nu, mu)
    (0.0, 0.25): 0.09910, (0.0, 0.5): 0.52191, (0.0, 1.0): 0.88959,
    (0.3, 0.125): 0.09243, (0.3, 0.25): 0.54321, (0.3, 0.5): 0.94102, (0.3, 1.0): 0.99789,
}  # fmt: skip
INTEGRALS_LINE = {
    0.3: (1.04269, 0.09348, 4.18e-4),
    0.0: (1.07903, 0.11847, 3.71e-3),
}  # P/P_H, int q/P, D/(A P^2), mu = .25
FULL_STICK_LINE = {0.0: 1.246419, 0.3: 1.065856}  # P/P_H(a), REFERENCES.md, 2.3
STEPS = {1: (0.2205, 64.1e-4), 5: (0.5128, 11.2e-4), 10: (0.5282, 7.1e-4), 50: (0.5385, 4.6e-4), 200: (0.5436, 4.3e-4)}
# q A R/a at x/a = 0 ... 1, nu = .3, mu = .25
CURVE = np.array([0, 0.0955, 0.1500, 0.1872, 0.2103, 0.2184, 0.2031, 0.1788, 0.1480, 0.1054, 0])
COLUMNS_LINE = "nu mu block_height_mm points_per_a increments P_over_Hertz q_over_P D_over_AP2 c_over_a"
COLUMNS_LINE += " reported_D_over_AP2 plain"
FEW = 5
"""Increments of which a second-order error is left; twice as many give the stick zone to the point."""
HEIGHTS = (100.0, 200.0)
STUCK = 1e6


def end_force_loss(profiles: list[Profile]) -> float:
    """Sum of slip times the friction at the end of each increment (mJ), first order in the increment."""
    lost, before = 0.0, 0.0
    for state in (p.frame.state for p in profiles):
        lost -= float(((state.accumulated_slip - before)[:, 0] * state.force[:, 1] * (state.status == SLIP)).sum())
        before = state.accumulated_slip
    return lost


def numbers(profiles: list[Profile], nu: float) -> np.ndarray:
    """P/P_H(a), int q/P, D/(A P^2) by end forces, c/a, D/(A P^2) as reported.

    The first, second and fourth are means over the second half of a self-similar loading, D is at its end.
    """
    last, soft = profiles[-1], compliance(nu)
    force, outward, stick, lost = _halfplane.numbers(profiles, soft, by_reach=not (last.status == SLIP).any())
    return np.array([force, outward, end_force_loss(profiles) / (soft * last.force**2), stick, lost])


def _line(quick: bool) -> Result:
    """Does a cylinder pressed on a half-plane with friction stick, slip and dissipate as Spence's solution says?

    Source: the self-similar solution of Spence 1968 and 1975; Nowell, Hills and Sackfield 1988; Johnson 1985, sec.
    5.4. Its values are in validation/REFERENCES.md, 2.1 to 2.4, and `_spence.py` recomputes most of them. While a
    parabola is pressed, c/a, P/P_Hertz(a), int q/P and dissipation/(A P^2) are constants of (beta, mu).

    The body is a block with a fixed base, of half length and height h. The base changes the strain at the surface
    in proportion to a/h: the integrals are computed at a/h = 1/100 and 1/200 and extrapolated linearly to 0. Forces
    are compared at equal a. Since the solution is self-similar, means over the second half of the increments are
    used; they remove the scatter of a and c by one point.

    The values for 1 to 200 increments are those of plain increments, in which a point that closes slips from where
    it was at their start, and of friction at the end of each increment, as in the integral equations; so is the
    column of the table. finger3d itself holds a point where it touches and takes the friction under the mean normal
    force: its c/a and its dissipation are those of Spence in few increments, too.

    Meshes of 10, 20, 40 points to a, 1 to 200 increments, the half-plane by extrapolation in a/h.
    """
    meshes = (10, 14, 20) if quick else (10, 20, 40)
    finest, most = meshes[-1], 50 if quick else 200
    counts = [n for n in STEPS if n <= most]
    rows, table, curves = [], [], {}
    for nu in (0.3,) if quick else (0.3, 0.0):
        at, plain, c_last, c_own = {}, {}, {}, {}
        for height, points in [(HEIGHTS[0], finest), *((HEIGHTS[1], n) for n in meshes)]:
            problem = line(nu, points, loading(1), height)
            if height == HEIGHTS[1] and not quick:
                at[height, points, STUCK, 400] = numbers(under(problem, STUCK, loading(400, height)), nu)
            for count in counts if points == finest else (most,):
                profiles = under(problem, 0.25, loading(count, height))
                at[height, points, 0.25, count] = numbers(profiles, nu)
                c_own[height, count] = profiles[-1].c / profiles[-1].a
                if points == finest:
                    stepped = under(problem, PlainCoulomb(0.25), loading(count, height))
                    plain[height, points, 0.25, count] = numbers(stepped, nu)
                    c_last[height, count] = stepped[-1].c / stepped[-1].a
            if height == HEIGHTS[1] and points == finest:
                curves[nu] = profiles[-1]
                for mu in [m for n, m in C_OVER_A_LINE if n == nu and m != 0.25 and not quick]:
                    at[height, points, mu, most] = numbers(under(problem, mu, loading(most, height)), nu)
        for kind, found in enumerate((at, plain)):
            table += [(nu, k[2], k[0], k[1], k[3], *v, kind) for k, v in found.items()]
        rows += _gates(nu, at, plain, finest, most)
        rows += _few_rows(nu, at, c_own, finest, most)
        if nu == 0.3:
            rows += _step_rows(plain, c_last, finest, counts)
            rows.append(judged("q-x-largest-deviation-over-its", _off_curve(curves[nu])))
    columns = exact_columns(COLUMNS_LINE, table)
    return Result(tuple(rows), columns, lambda figure: _draw_line(figure, curves[0.3], columns, finest))


def _extrapolated(at: dict[Any, np.ndarray], finest: int, mu: float, count: int) -> np.ndarray:
    near, far = (at[h, finest, mu, count] for h in HEIGHTS)
    return 2.0 * far - near


def _gates(nu: float, at: dict[Any, np.ndarray], plain: dict[Any, np.ndarray], finest: int, most: int) -> Iterator[Row]:
    value = _extrapolated(at, finest, 0.25, most)
    force, outward, lost = INTEGRALS_LINE[nu]
    here = f"nu = {nu:g}, mu = .25"
    yield judged("p-p-hertz-a", value[0], force, here=here)
    yield judged("int-0-a-q-p", value[1], outward, here=here)
    yield judged("dissipation-a-p-2-increments", value[4], lost, here=here, most=most)
    if most == 200:  # fewer increments are not yet on the line ~ 1/N
        few, many = (_extrapolated(plain, finest, 0.25, n)[2] for n in (50, most))
        in_steps = many + (many - few) * 50 / (most - 50)
        yield judged("dissipation-by-end-forces-plain-increments", in_steps, lost, here=here)
    stuck = [at[HEIGHTS[1], n, STUCK, 400][0] for n in (finest // 4, finest // 2, finest) if most == 200]
    if stuck:
        what = f"P/P_Hertz(a), full stick, nu = {nu:g}"
        got = 2.0 * stuck[2] - stuck[1]
        yield judged("extrapolated", got, FULL_STICK_LINE[nu], what=what)
    if stuck and nu == 0.0:
        rate = float(np.log((stuck[0] - FULL_STICK_LINE[nu]) / (stuck[2] - FULL_STICK_LINE[nu])) / np.log(4.0))
        yield judged("rate-of-its-error", rate, what=what)
    for (case_nu, mu), want in C_OVER_A_LINE.items():
        key = (HEIGHTS[1], finest, mu, most)
        if case_nu == nu and key in at:
            yield judged("c-a-nu-mu", at[key][3], want, tolerance=0.5 / finest, nu=nu, mu=mu, finest=finest)


def _few_rows(nu: float, at: dict[Any, np.ndarray], c_own: dict[Any, float], finest: int, most: int) -> list[Row]:
    """Rows of what few increments leave."""
    here = f"nu = {nu:g}, mu = .25"
    change = c_own[HEIGHTS[1], 2 * FEW] - c_own[HEIGHTS[1], most]
    lost = {n: at[HEIGHTS[1], finest, 0.25, n][4] for n in (FEW, 2 * FEW, most)}
    rate = float(np.log2((lost[FEW] - lost[most]) / (lost[2 * FEW] - lost[most])))
    return [
        judged("c-a-at-the-end", change, tolerance=0.5 / finest, here=here, value=2 * FEW, most=most, finest=finest),
        judged("rate-at-which-the-dissipation-settles", rate, here=here, value=2 * FEW),
    ]


def _step_rows(at: dict[Any, np.ndarray], c_last: dict[Any, float], finest: int, counts: list[int]) -> Iterator[Row]:
    for count in counts:
        want_c, want_d = STEPS[count]
        got = _extrapolated(at, finest, 0.25, count)[2]
        here, c = f"N = {count} plain increments", c_last[HEIGHTS[1], count]
        yield judged("dissipation-a-p-2-by-end", got, want_d, here=here)
        yield judged("c-a", c, want_c, tolerance=1.0 / finest, here=here)
    errors = [_extrapolated(at, finest, 0.25, n)[2] - INTEGRALS_LINE[0.3][2] for n in (1, 10)]
    yield judged("rate-at-which-the-error", float(np.log10(errors[0] / errors[1])))


def _off_curve(profile: Profile) -> float:
    """Largest deviation of q(x) from the integral equations', over its peak."""
    got = _normalised(profile, np.linspace(0.0, 1.0, 11))
    return float(np.abs(got - CURVE)[:-1].max() / CURVE.max())


def _normalised(profile: Profile, at: np.ndarray) -> np.ndarray:
    """q A R / a at x = a `at`."""
    return np.interp(at * profile.a, profile.x, profile.q) * compliance(0.3) * RADIUS / profile.a


def _draw_line(figure: Any, profile: Profile, columns: dict[str, list[float]], finest: int) -> None:
    left, right = figure.subplots(1, 2)
    figure.suptitle(f"cylinder, nu = .3, mu = .25: error of friction {100 * _off_curve(profile):.1f} %")
    here = np.abs(profile.x) <= profile.a
    left.plot(profile.x[here] / profile.a, profile.q[here] * compliance(0.3) * RADIUS / profile.a, label="finger3d")
    left.plot(np.linspace(0, 1, 11), CURVE, "k--", label="integral equations")
    left.set(xlabel="x/a", ylabel="outward friction q A R/a", xlim=(0, 1), ylim=(0, None))
    for (height, plain), t in grouped(columns, "block_height_mm", "plain", nu=0.3, mu=0.25, points_per_a=finest):
        loss, name = (t["D_over_AP2"], "plain") if plain else (t["reported_D_over_AP2"], "finger3d")
        right.loglog(t["increments"], 1e4 * loss, "o-" if plain else "s-", label=f"{name}, a/h = 1/{height:g}")
    right.loglog(list(STEPS), [1e4 * d for _, d in STEPS.values()], "k+", ms=10, label="integral equations")
    right.axhline(1e4 * INTEGRALS_LINE[0.3][2], color="k", ls="--", lw=0.8, label="N = infinity")
    right.set(xlabel="increments N", ylabel="1e4 dissipation/(A P^2)")


C_OVER_A_SPHERE = {
    (0.0, 0.125): 0.04180, (0.0, 0.25): 0.36896, (0.0, 0.5): 0.81265, (0.0, 1.0): 0.96827,
    (0.3, 0.06): 0.02826, (0.3, 0.125): 0.34734, (0.3, 0.25): 0.82416, (0.3, 0.5): 0.98416, (0.3, 1.0): 0.99948,
}  # fmt: skip
INTEGRALS_SPHERE = {0.3: (1.01341, 0.18168, 1.8e-4), 0.0: (1.02718, 0.23809, 3.17e-3)}  # P/P_H(depth), T/P, D/(P depth)
FULL_STICK_SPHERE = {0.0: 1.052891, 0.3: 1.016213}
COLUMNS_SPHERE = "body nu mu points_per_a increments P_over_Hertz T_over_P D_over_Pd c_over_a iterations"
DEPTH = 1.0 / _halfspace.RADIUS  # a = 1


def hertz_sphere(nu: float) -> float:
    """Frictionless force at DEPTH, N (Johnson 1985, sec. 4.2)."""
    return 4.0 / 3.0 / (1.0 - nu**2) * np.sqrt(_halfspace.RADIUS) * DEPTH**1.5


def depths(count: int) -> list[float]:
    """Equal increments of the depth, that is of a^2."""
    return [DEPTH * k / count for k in range(1, count + 1)]


def _sphere(quick: bool) -> Result:
    """Does a ball pressed on a half-space with friction stick, slip and dissipate as the coupled solution says?

    Source: the self-similar solution of Spence 1968 and 1975, Johnson 1985, sec. 5.4; its values are in
    validation/REFERENCES.md, 2.2 and 2.3. While a paraboloid is pressed, c/a, P/P_Hertz(depth), T/P and
    dissipation/(P depth) are constants of (nu, mu).

    Two computations: the contact solution alone, on rings over the exact half-space (influence functions of Johnson
    1985, ch. 3); and the whole chain in 3D, quadratic tetrahedra under a quarter of a block with contact points a/4
    to a/10 apart. The block is 50 a high; its compliance is removed by dividing by the frictionless force on the
    same mesh.

    Rings a/80 wide under 200 increments; tets of a/4, a/7, a/10 under 40.
    """
    rings, many, meshes = (40, 50, (5,)) if quick else (80, 200, (4, 7, 10))
    rows, table, found = [], [], {}
    for nu in (0.3,) if quick else (0.3, 0.0):
        body = _rings.rings(nu, round(1.1 * rings), round(1.1 * rings) / rings)
        cases = [(0.25, 40), (0.25, 50), (0.25, many), (1e6, many)]
        cases += [(mu, many) for n, mu in C_OVER_A_SPHERE if n == nu and mu != 0.25 and not (quick and mu > 0.2)]
        for mu, count in dict.fromkeys(cases):
            r = _rings.press(body, _halfspace.RADIUS, mu, depths(count))
            found["rings", nu, mu, rings, count] = np.array(
                [r.P / hertz_sphere(nu), r.T / r.P, r.D / (r.P * DEPTH), r.c / r.a, r.iterations]
            )
        for points in meshes:
            ball = _halfspace.Ball.on(_halfspace.block(nu, points, 20.0 if quick else 50.0))
            force = _halfspace.press(ball, 0.0, [(DEPTH, 0.0)])[-1].P
            steps = _halfspace.press(ball, 0.25, [(d, 0.0) for d in depths(40)])
            s = steps[-1]
            stuck, most = np.sqrt(s.stick_area / s.area), max(t.iterations for t in steps)
            found["tets", nu, 0.25, points, 40] = np.array([s.P / force, s.T / s.P, s.D / (s.P * DEPTH), stuck, most])
        rows += [*_ring_rows(nu, found, rings, many), *_tet_rows(nu, found, rings, meshes)]
    table = exact_columns(COLUMNS_SPHERE, [(*k, *v) for k, v in found.items()])
    return Result(tuple(rows), table, lambda figure: _draw_sphere(figure, table))


def _ring_rows(nu: float, found: dict[Any, np.ndarray], rings: int, many: int) -> Iterator[Row]:
    force, sum_, lost = INTEGRALS_SPHERE[nu]
    value = found["rings", nu, 0.25, rings, many]
    here = f"rings, nu = {nu:g}, mu = .25"
    yield judged("p-p-hertz-depth", value[0], force, here=here)
    yield judged("t-p", value[1], sum_, here=here)
    yield judged("p-p-hertz-depth-full-stick", found["rings", nu, 1e6, rings, many][0], FULL_STICK_SPHERE[nu], nu=nu)
    if many == 200:
        in_steps = value[2] + (value[2] - found["rings", nu, 0.25, rings, 50][2]) * 50 / (200 - 50)
        rounding = 0.5 * 10.0 ** np.floor(np.log10(lost) - (1 if nu else 2)) / lost
        yield judged("d-p-depth-extrapolated-in-1", in_steps, lost, tolerance=0.03 + rounding, here=here)
    for (case, mu), want in C_OVER_A_SPHERE.items():
        key = ("rings", nu, mu, rings, many)
        if case == nu and key in found:
            yield judged("c-a-rings-nu-mu", found[key][3], want, tolerance=1.0 / rings, nu=nu, mu=mu, rings=rings)


def _tet_rows(nu: float, found: dict[Any, np.ndarray], rings: int, meshes: tuple[int, ...]) -> Iterator[Row]:
    force, sum_, _ = INTEGRALS_SPHERE[nu]
    value = found["tets", nu, 0.25, meshes[-1], 40]
    here = f"3D, nu = {nu:g}, mu = .25, {meshes[-1]} points to a"
    yield judged("p-p-frictionless-depth", value[0], force, here=here)
    yield judged("t-p", value[1], sum_, here=here)
    exact = found["rings", nu, 0.25, rings, 40][2]
    if len(meshes) > 2:
        first, last = (found["tets", nu, 0.25, n, 40][2] - exact for n in (meshes[0], meshes[-1]))
        rate = np.log(first / last) / np.log(meshes[-1] / meshes[0])
        yield judged("rate-at-which-the-excess-of", float(rate), nu=nu)
        wanted = C_OVER_A_SPHERE[nu, 0.25]
        yield judged("c-a-of-tets", value[3], wanted, tolerance=1.0 / meshes[-1], here=here, finest=meshes[-1])


def _draw_sphere(figure: Any, table: dict[str, list[Any]]) -> None:
    figure.suptitle("ball")
    left, right = figure.subplots(1, 2)
    for k, (nu, t) in enumerate(grouped(table, "nu", body="rings")):
        slips = t["mu"] < STUCK
        left.semilogx(t["mu"][slips], t["c_over_a"][slips], f"C{k}o", mfc="none", label=f"rings, nu = {nu:g}")
        wanted = {m: c for (n, m), c in C_OVER_A_SPHERE.items() if n == nu}
        left.semilogx(list(wanted), list(wanted.values()), f"C{k}--", label="reference")
    for k, (nu, t) in enumerate(grouped(table, "nu", body="tets")):
        for name, mark, key, want in zip(
            ("force", "friction"), "os", ("P_over_Hertz", "T_over_P"), INTEGRALS_SPHERE[nu], strict=False
        ):
            error = 100 * np.abs(t[key] / want - 1)
            right.loglog(t["points_per_a"], error, f"C{k}{mark}-", label=f"{name}, nu = {nu:g}")
    left.set(xlabel="mu", ylabel="stick radius / contact radius")
    right.set(xlabel="points per a", ylabel="error, %", title="3D, mu = .25")
    ticks_at(right, sorted(set(t["points_per_a"])))


def run(quick: bool) -> Result:
    """The cylinder, then the ball."""
    return together((10.0, 9.0), line=_line(quick), sphere=_sphere(quick))
