"""Do two elastic bodies, a steel cylinder on an aluminium block, show the half-width and peak of NAFEMS CGS-1?

Source: NAFEMS CGS-1 (Konter 2006; validation/REFERENCES.md, 6.4): a cylinder, R = 50 mm, E = 210 GPa, on a block of 200
x 200 mm, E = 70 GPa, both nu = 0.3, plane strain, 35 kN per mm: a = 6.21 mm, p0 = 3585.37 MPa.  These are Hertz's
values with the sum of both compliances.  Here the lower half of the cylinder is held on its cut and the block on its
base; the compliances of both at points that face each other are added, and one contact problem is solved.

Hertz's theory neglects a/R = 0.12 (a circle is steeper than a parabola: both are solved) and a/h = 0.12 in the
cylinder, which move the edge by 0.15 %.  Expected rate: first order in the point spacing for the pressure in L2, whose
approximation is piecewise linear at a square-root edge.  It is measured under the parabola against the ellipse fitted
to p^2 on the finest mesh, as the root mean square over 8 loads.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import Mesh

from ._common import Body, body, box, contact_axis, convergence, ellipse, ellipse_error, graded, held_at, mapped, rate
from ._rows import Result, Row, exact_columns, rms

R, SIDE, FORCE = 50.0, 200.0, 35e3
NU = 0.3
MODULUS = 1.0 / ((1.0 - NU**2) / 210e3 + (1.0 - NU**2) / 70e3)
_NAFEMS = "NAFEMS CGS-1; REFERENCES.md, 6.4"
_ONE = "Hertz neglects a/R and a/h of 0.12; 0.3 % or less measured, and coarser meshes must pass too"
_GROWTH = 1.3


def quarter_disc(p: Float) -> Float:
    """Quarter of the cylinder (mm) from the unit square; its side y = 1 lies around the lowest point, turned up."""
    x, y = p.T
    return R * np.stack([x * np.sqrt(1.0 - 0.5 * y**2), y * np.sqrt(1.0 - 0.5 * x**2)], axis=1)


def pair(count: int) -> Body:
    """Both bodies as one compliance over facing points x >= 0, `count` to the half-width; normal forces only."""
    step = 6.2 / R / np.sqrt(0.5)
    side = contact_axis(step, count, 1.0, _GROWTH)
    up = 1.0 - graded(1.0, 0.7 * step / count, _GROWTH)[::-1]
    round_mesh = mapped(box([side, up]), quarter_disc)
    cylinder = _half(round_mesh, 210e3)
    facing = np.sort(cylinder.surface.points[:, 0])
    far = facing[-1] + graded(0.5 * SIDE - facing[-1], _GROWTH * (facing[-1] - facing[-2]), _GROWTH)
    x = np.concatenate([facing, far[1:]])
    flat_mesh = mapped(box([x, SIDE - graded(SIDE, 6.2 / count, _GROWTH)[::-1]]), lambda p: p)
    block = _half(flat_mesh, 70e3)
    order = np.argsort(cylinder.surface.points[:, 0]), np.argsort(block.surface.points[:, 0])
    # forces are equal and opposite point by point; without friction the tangents of the two need not be told apart
    first, second = (b.compliance[np.ix_(k, [0], k, [0])] for b, k in zip((cylinder, block), order, strict=True))
    c = first + second
    whole = np.zeros((len(facing), 2, len(facing), 2))
    whole[:, :1, :, :1] = c
    whole[:, 1, :, 1] = np.eye(len(facing)) * c.max()
    area = block.surface.area[order[1]]
    return Body(replace(block.surface, points=np.stack([facing, 0.0 * facing], axis=1), area=area), whole)


def _half(mesh: Mesh, modulus: float) -> Body:
    """Half a body, held on its base, to contact points up to x = 12 mm."""
    held = held_at(mesh, {"x-": [0], "y-": [0, 1]})
    return body(mesh, Elasticity.of(modulus, NU), held, "y+", lambda p: p[:, 0] < 12.0)


def pressed(both: Body, gap: Float, force: float) -> Float:
    """Nodal pressures (n,) MPa under half of a force (N per mm), found by the depth that gives it."""
    depth = brentq(lambda d: both.normal_force(gap - d).sum() - 0.5 * force, 0.1, 3.0, xtol=1e-10)
    return both.normal_force(gap - depth) / both.surface.area


def run(quick: bool) -> Result:
    """Three sizes and more, a circle and a parabola."""
    counts = (8, 16, 32) if quick else (10, 20, 40, 80)
    loads = FORCE * np.linspace(0.7, 1.0, 8)
    hertz = [float(np.sqrt(4.0 * load * R / (np.pi * MODULUS))) for load in loads]
    a, p0 = hertz[-1], 2.0 * FORCE / (np.pi * hertz[-1])
    table, levels = [], []
    for n in counts:
        both = pair(n)
        x = both.surface.points[:, 0]
        levels.append((x, [pressed(both, x**2 / (2.0 * R), load) for load in loads]))
        circle = pressed(both, R - np.sqrt(R**2 - x**2), FORCE)
        found = {"parabola": ellipse(x, levels[-1][1][-1], 0.9 * a), "circle": ellipse(x, circle, 0.9 * a)}
        table += [(name, n, *values) for name, values in found.items()]
    limits = [ellipse(levels[-1][0], p, 0.9 * v) for p, v in zip(levels[-1][1], hertz, strict=True)]
    errors = [rms(ellipse_error(x, p, *e) for p, e in zip(ps, limits, strict=True)) for x, ps in levels]
    rows = [
        Row("Hertz's own half-width (mm)", _NAFEMS, 6.21, a, 1e-3, "three digits published"),
        Row("Hertz's own peak (MPa)", _NAFEMS, 3585.37, p0, 1e-5, "six digits published"),
    ]
    for name, (width, peak) in found.items():
        rows.append(Row(f"half-width, {name} (mm)", _NAFEMS, 6.21, width, 0.01, _ONE))
        rows.append(Row(f"peak pressure, {name} (MPa)", _NAFEMS, 3585.37, peak, 0.01, _ONE))
    why = "8 loads sample the position of the edge between two points; a higher rate passes"
    got = rate(1.0 / np.array(counts), errors)
    rows.append(Row("rate of the pressure in L2, parabola", "square-root edge", 1.0, got, 0.1, why, measure="at least"))
    names = "gap points_per_a half_width_mm peak_MPa"
    return Result(
        tuple(rows), exact_columns(names, table), lambda figure: draw(figure, counts, errors, (x, circle), (a, p0))
    )


def draw(
    figure: Any, counts: tuple[int, ...], errors: list[float], finest: tuple[Float, Float], hertz: tuple[float, float]
) -> None:
    """Errors over the point spacing; the pressure against Hertz's."""
    left, right = figure.subplots(1, 2)
    label = "relative L2 error of the pressure, rms over loads"
    convergence(left, 1.0 / np.array(counts), {"parabola": errors}, 1.0, "point spacing / a", label)
    x = np.linspace(0.0, 8.0, 1001)
    right.plot(x, hertz[1] * np.sqrt(np.maximum(0.0, 1.0 - (x / hertz[0]) ** 2)), "k--", linewidth=1.0, label="Hertz")
    right.plot(*finest, "o", markersize=4.0, label=f"circle, {counts[-1]} points to a")
    right.set(xlim=(0.0, 8.0), xlabel="x, mm", ylabel="pressure, MPa")
