"""Do a pressed cylinder and ball slip from the edge inward under a tangential load, and lose what Mindlin says?

Source: Cattaneo 1938; Mindlin 1949; Mindlin and Deresiewicz 1953; Johnson 1985, secs. 7.2 and 7.4; the formulas are in
validation/REFERENCES.md, 3.1 and 3.2, with s = Q/(mu P).  They are exact for beta = 0 only, hence nu = 1/2 (plane
strain, mixed elements).  For the ball they neglect that slip has a component across the load.

The cylinder and the ball are pressed, then slid to +S, -S and +S; the last two slides are the loop.  The work lost is
found in two ways: as the sum of friction times slip over the points, and as the area enclosed by Q over the slide at
the ends of the increments.  c/a and the first do not depend on the number of increments; the second has the error of
the trapezoidal rule.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any

import numpy as np

from finger3d.contact.friction import STICK
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Leg

from . import _halfplane, _halfspace
from ._common import ticks_at
from ._rows import Result, Row, exact_columns, grouped, listed

judged = listed(__file__)

NU, MU = 0.5, 0.25
DEPTH = float(_halfplane.depth(1.0, _halfplane.DEPTH_OF_BLOCK))
SHARES = (0.5, 1.0, 1.4)  # of mu times the depth: slides of the cylinder
COLUMNS = "dim points_per_a increments s a_mm c_over_a c_over_a_exact W_over_exact loop_over_exact shift_over_exact"


def line_loss(s: float, force: float) -> float:
    """Work lost in a cycle between -Q and Q, mJ on 1 mm of width (validation/REFERENCES.md, 3.1)."""
    factor = 2.0 * (1.0 - s) * np.log(1.0 - s) + 2.0 * s - s**2
    return float(_halfplane.compliance(NU) * (MU * force) ** 2 * factor / np.pi)


def ball_shift(s: float, force: float, a: float) -> float:
    """Tangential displacement of a ball, mm."""
    stiff = (2.0 - NU) * 2.0 * (1.0 + NU)
    return float(3.0 * MU * force * stiff / (16.0 * a) * (1.0 - (1.0 - s) ** (2.0 / 3.0)))


def ball_loss(s: float, force: float, a: float) -> float:
    """Work lost in a cycle of a ball, mJ."""
    stiff = (2.0 - NU) * 2.0 * (1.0 + NU)
    factor = 1.0 - (1.0 - s) ** (5.0 / 3.0) - 5.0 * s / 6.0 * (1.0 + (1.0 - s) ** (2.0 / 3.0))
    return float(9.0 * (MU * force) ** 2 * stiff / (10.0 * a) * factor)


@functools.cache
def problem(points: int) -> Problem:
    """A cylinder that may slide as far as any here."""
    return _halfplane.line(NU, points, (Leg(DEPTH), Leg(DEPTH, SHARES[-1] * MU * DEPTH)))


def cylinder(points: int, increments: int) -> list[tuple[float, ...]]:
    """Rows of the table for a cylinder, one per slide."""
    rows = []
    for share in SHARES:
        slide, press = share * MU * DEPTH, 10
        turns = [(slide, increments), (-slide, 2 * increments), (slide, 2 * increments)]
        legs = (Leg(DEPTH, steps=press), *(Leg(DEPTH, slide_x_mm=x, steps=n) for x, n in turns))
        found = _halfplane.under(problem(points), MU, legs)
        before, peak = found[press - 1], press - 1 + increments
        q = np.array([p.q @ p.area for p in found[peak:]])
        at = np.array([p.frame.target.slide_x_mm for p in found[peak:]])
        force, s = before.force, float(q[0] / (MU * before.force))
        stuck = found[peak].x[found[peak].status == STICK]
        spacing = float(np.diff(before.x).min())
        exact = line_loss(s, force)
        lost = found[-1].frame.dissipation_mJ - found[peak].frame.dissipation_mJ
        c = 0.5 * (float(np.ptp(stuck)) + spacing) / before.a
        shares = lost / exact, np.trapezoid(q, at) / exact
        rows.append((2, points, increments, s, before.a, c, float(np.sqrt(1.0 - s)), *shares, np.nan))
    return rows


def ball(points: int, height: float, increments: int) -> list[tuple[float, ...]]:
    """Rows of the table for a ball at two slides on the way to the peak, the second with the loop."""
    part = _halfspace.half(NU, points, height)
    depth = 1.0 / _halfspace.RADIUS
    press = [(depth * k / 4, 0.0) for k in range(1, 5)]
    force = _halfspace.press(part, MU, press)[-1].P
    a = float((0.75 * force * _halfspace.RADIUS * (1.0 - NU**2)) ** (1.0 / 3.0))
    slide = 0.8 * ball_shift(1.0, force, a)
    up = [slide * k / increments for k in range(1, increments + 1)]
    down = [slide * (1.0 - k / increments) for k in range(1, 2 * increments + 1)]
    found = _halfspace.press(part, MU, [*press, *((depth, x) for x in [*up, *down, *(-x for x in down)])])
    rows = []
    for k in (increments // 2, increments):
        peak = found[3 + k]
        s = peak.Q / (MU * peak.P)
        exact = ball_loss(s, force, a)
        lost = area = np.nan
        if k == increments:
            after = found[3 + k :]
            lost = (after[-1].D - peak.D) / exact
            area = float(np.trapezoid([t.Q for t in after], [t.slide for t in after])) / exact
        c = float(np.sqrt(peak.stick_area / peak.area))
        shift = peak.slide / ball_shift(s, force, a)
        rows.append((3, points, increments, s, a, c, (1.0 - s) ** (1.0 / 3.0), lost, area, shift))
    return rows


def run(quick: bool) -> Result:
    """Cylinder: a/10, a/20, a/40 and 5, 10, 20 increments to the peak; ball: a/4, a/6, a/8."""
    meshes, solid, height = ((20,), (4,), 20.0) if quick else ((10, 20, 40), (4, 6, 8), 50.0)
    fine = meshes[-1]
    runs = [(points, 10) for points in meshes] + [(fine, count) for count in (5, 20) if not quick]
    table = [row for points, count in runs for row in cylinder(points, count)]
    table += [row for points in solid for row in ball(points, height, 10)]
    rows = (*_line_rows(table, fine), *_ball_rows(table, solid[-1]))
    columns = exact_columns(COLUMNS, table)
    return Result(rows, columns, lambda figure: _draw(figure, columns, (fine, solid[-1])))


def _line_rows(table: list[tuple[float, ...]], fine: int) -> Iterator[Row]:
    wide = 0.03 if fine >= 40 else 0.1
    most = max(r[2] for r in table if r[:2] == (2, fine))
    for _, points, count, s, _, c, exact, lost, area, _ in [r for r in table if r[:2] == (2, fine)]:
        here = f"cylinder, s = {s:.3f}, {points:g} points to a, {count:g} increments"
        if count == 10:
            yield judged("c-a", c, exact, tolerance=0.5 / points, here=here, points=points)
            yield judged("work-lost-in-a-cycle-over", lost, tolerance=wide, here=here)
        if count == most:
            yield judged("area", area, tolerance=wide, here=here)
    if most == 20:
        few, many = ([r for r in table if r[:3] == (2, fine, n)] for n in (5, most))
        for k, name in ((5, "c/a"), (7, "work lost in a cycle over the exact one")):
            change = max(abs(one[k] - other[k]) for one, other in zip(few, many, strict=True))
            yield judged("cylinder", change, name=name, most=most)
        first, last = (max(abs(r[7] - 1.0) for r in table if r[:3] == (2, n, 10)) for n in (10, fine))
        falls = float(np.log(first / last) / np.log(fine / 10))
        yield judged("rate-at-which-the-error", falls)
        gaps = [max(abs(r[8] - r[7]) for r in table if r[:3] == (2, fine, n)) for n in (5, 20)]
        falls = float(np.log(gaps[0] / gaps[1]) / np.log(4.0))
        yield judged("rate-at-which-the-area", falls)


def _ball_rows(table: list[tuple[float, ...]], fine: int) -> Iterator[Row]:
    for _, points, _, s, _, c, exact, lost, area, shift in [r for r in table if r[:2] == (3, fine)]:
        here = f"ball, s = {s:.3f}, {points:g} points to a"
        yield judged("slide-over-the-exact-one", shift, here=here)
        yield judged("c-a-of-ball", c, exact, tolerance=1.0 / points, here=here, points=points)
        if np.isfinite(lost):
            yield judged("work-lost-by-ball", lost, here=here)
            yield judged("area-of-ball", area, here=here)


def _draw(figure: Any, table: dict[str, list[float]], fine: tuple[int, int]) -> None:
    left, right = figure.subplots(1, 2)
    s = np.linspace(0.0, 1.0, 200)
    for (dim, points), t in grouped(table, "dim", "points_per_a", increments=10):
        name, style = ("cylinder", "k--") if dim == 2 else ("ball", "k:")
        if points in fine:
            left.plot(s, (1.0 - s) ** (1.0 / dim), style, lw=1, label=f"{name}, exact")
            left.plot(t["s"], t["c_over_a"], "o" if dim == 2 else "s", label=f"{name}, finger3d")
        worst = 100.0 * np.nanmax(np.abs(t["W_over_exact"] - 1.0))
        right.loglog(points, worst, "C0o" if dim == 2 else "C1s", label=name if points in fine else None)
    right.loglog([10, 40], [8, 2], "k:", lw=1, label="slope -1")
    ticks_at(right, [4, 10, 20, 40])
    left.set(xlabel="s = Q/(mu P)", ylabel="c/a", title="stick zone")
    right.set(xlabel="points per a", ylabel="error of the work lost in a cycle, %", title="mesh")
