"""Do two balls pressed together show the peak pressure of Code_Aster's SSNV104, and of what theory is it true?

Source: Code_Aster V6.04.104 (validation/REFERENCES.md, 6.2): two half balls, R = 50 mm, E = 20 000 MPa, nu = 0.3, whose
cut faces approach each other by 4 mm and may widen.  By symmetry one half ball meets a rigid plane at half the
approach, with its cut face on rollers; an eighth of a ball is meshed in 3D.

The published -2798.3 MPa is Hertz's value for half-spaces at that approach.  Here a/R = 0.21, and a ball between two
plates is stiffer: the force at the far pole displaces the near one (Tatara 1991; validation/REFERENCES.md, 1.8).  The
correct peak is 4.0 % above the published one.  Both are compared, Tatara's with a tolerance of 1 %. Expected rate:
first order in the point spacing for the pressure in L2, piecewise linear at a square-root edge.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import brentq

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity

from ._common import Body, ball_numbers, body, box, contact_axis, ellipse, graded, held_at, mapped, rate
from ._rows import Result, exact_columns, listed

judged = listed(__file__)

R, E, NU = 50.0, 20_000.0, 0.3
MODULUS = E / (1.0 - NU**2)
DEPTHS = np.linspace(1.0, 2.0, 12)  # mm, half the approach


def eighth(p: Float) -> Float:
    """Eighth of the ball from the unit cube; its side y = 1 lies around the pole."""
    square = p**2
    j, k = square[:, [1, 2, 0]], square[:, [2, 0, 1]]
    return R * p * np.sqrt(1.0 - 0.5 * j - 0.5 * k + j * k / 3.0)


def ball(count: int) -> Body:
    """Contact points of the ball, `count` to the contact radius at full approach."""
    step = 10.4 / R / np.sqrt(0.5)
    side, up = contact_axis(step, count, 1.0), 1.0 - graded(1.0, 0.7 * step / count, 1.6)[::-1]
    mesh = mapped(box([side, up, side]), eighth)
    held = held_at(mesh, {"x-": [0], "y-": [1], "z-": [2]})
    return body(mesh, Elasticity.of(E, NU), held, "y+", lambda p: np.hypot(p[:, 0], p[:, 2]) < 14.0)


def force_at(a: float) -> float:
    """Hertz's force (N) at a contact radius on a plane."""
    return 4.0 / 3.0 * MODULUS * a**3 / R


def tatara(depth: float) -> float:
    """Contact radius (mm) at a depth of the plane, the ball's other side counted."""

    def away(a: float) -> float:
        far = a**2 + 4.0 * R**2
        f = 2.0 * (1.0 + NU) * R**2 / far**1.5 + (1.0 - NU**2) / far**0.5
        return a**2 / R - force_at(a) * f / (np.pi * E) - depth

    return float(brentq(away, 1.0, 20.0))


def measured(count: int) -> Float:
    """Per depth: force (N), contact radius by the second moment (mm), peak of the line of p^2 (MPa), L2 error of p."""
    here = ball(count)
    gap = here.gap(lambda p: R - p[:, 1])
    place = np.sqrt((here.surface.points[:, [0, 2]] ** 2).sum(axis=1))
    found = []
    for depth in DEPTHS:
        f = here.normal_force(gap - depth)
        force, a, away = ball_numbers(here, f, R, MODULUS)
        reach = 0.8 * (0.75 * force * R / MODULUS) ** (1.0 / 3.0)
        found.append((force, a, ellipse(place, f / here.surface.area, reach)[1], away))
    return np.array(found)


def run(quick: bool) -> Result:
    """Three sizes."""
    counts = (3, 4, 6) if quick else (4, 6, 9)
    levels = [measured(n) for n in counts]
    last = levels[-1]
    true = np.array([tatara(d) for d in DEPTHS])
    force, a, peak, _ = last.T
    published = 2.0 / np.pi * MODULUS * np.sqrt(DEPTHS[-1] / R)
    wanted = 1.5 * force_at(true[-1]) / (np.pi * true[-1] ** 2)
    from_force = float((6.0 * force[-1] * MODULUS**2 / (np.pi**3 * R**2)) ** (1.0 / 3.0))
    rows = [
        judged("peak-of-half-spaces", published),
        judged("peak-beside-the-published", from_force),
        judged("peak-beside-tatara", from_force, wanted),
    ]
    if not quick:  # the line of p^2 needs 9 points to a
        rows.append(judged("peak-from-squares", peak[-1], wanted))
    errors = [float(np.sqrt(np.mean(level[:, 3] ** 2))) for level in levels]
    rows += [
        judged("force-over-tatara", np.mean(force / force_at(true))),
        judged("force-over-hertz", np.mean(force / force_at(a))),
        judged("rate-of-the-pressure", rate(1.0 / np.array(counts), errors)),
    ]
    names = "points_per_a approach_mm force_N contact_radius_mm peak_MPa pressure_L2_error"
    flat = [
        (n, 2.0 * d, *v) for n, level in zip(counts, levels, strict=True) for d, v in zip(DEPTHS, level, strict=True)
    ]
    return Result(tuple(rows), exact_columns(names, flat), lambda figure: _draw(figure, levels[-1][:, 0], true))


def _draw(figure: Any, force: Float, true: Float) -> None:
    """Force over approach against both theories."""
    axes = figure.subplots()
    axes.plot(2.0 * DEPTHS, force / 1e3, "o", label="finest mesh")
    axes.plot(2.0 * DEPTHS, force_at(true) / 1e3, "k--", linewidth=1.0, label="Hertz with Tatara's correction")
    axes.plot(2.0 * DEPTHS, force_at(np.sqrt(R * DEPTHS)) / 1e3, "k:", linewidth=1.0, label="Hertz, half-spaces")
    axes.set(xlabel="approach of the two balls, mm", ylabel="force, kN")
