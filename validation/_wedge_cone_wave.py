"""Do a wedge, a cone and a wave press as sharp and as periodic as their closed forms say?

Source: the closed forms of validation/REFERENCES.md, 1.4 (wedge: Johnson 1985, sec. 5.2; cone: Sneddon 1965) and 1.6
(wave: Westergaard 1939).  Forces are compared at equal a, which is read from a moment of the pressure: a^2 = 6 <x^2>
for the wedge, a^2 = 3 <r^2> for the cone, sin^2(pi a/lam) = 4 <sin^2(pi x/lam)> for the wave.

Expected rates: the force at equal a converges with second order in the point spacing h, like Hertz's.  The pressure in
L2 is limited by its worst point: h^(1/2) for the logarithm under a tip, h for a square-root edge.  The root mean square
over depths is used, because errors oscillate with the position of the edge.  The wedge's meshes are refined by halving;
one wedge is pressed on a mesh of finger3d's own mesher, whose growth of cells is fixed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.optimize import brentq

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.objects import Wave, Wedge

from ._common import (
    Body,
    body,
    box,
    contact_axis,
    convergence,
    distance,
    graded,
    halved,
    held_at,
    mapped,
    quarter_block,
    rate,
)
from ._halfplane import CANDIDATES, on_block
from ._rows import Result, exact_columns, listed

judged = listed(__file__)

NU, SLOPE, AMPLITUDE = 0.3, 0.01, 1e-3
MODULUS = 1.0 / (1.0 - NU**2)
PEAK = np.pi * MODULUS * AMPLITUDE  # p* for a wavelength of 1 mm

Errors = Float  # (depths, 2): force over the closed form at equal a, less 1; L2 error of the pressure, nan if not taken


TIP = Wedge(angle=math.atan(SLOPE))
HEIGHT, CONE = 200.0, 10.0
WEDGE_DEPTHS = 0.72 * SLOPE * np.linspace(0.7, 1.0, 20) * np.log(2.0 * HEIGHT)  # half-widths near 0.7 to 1 mm


def wedge(count: int) -> Errors:
    """Half of a block, its mesh halved from 5 points to a."""
    x, y = contact_axis(1.0, 5, HEIGHT), graded(HEIGHT, 0.2, 1.6)
    for _ in range(round(math.log2(count / 5))):
        x, y = halved(x), halved(y)
    mesh = mapped(box([x, HEIGHT - y[::-1]]), lambda p: p)
    held = held_at(mesh, {"x-": [0], "y-": [0, 1]})
    block = body(mesh, Elasticity.of(1.0, NU), held, "y+", lambda p: p[:, 0] < 1.5)
    gap = block.gap(lambda p: TIP.profile(p[:, 0], 0.0 * p[:, 0]))
    order = np.argsort(block.surface.points[:, 0])
    at, area = block.surface.points[order, 0], block.surface.area[order]
    found = []
    for depth in WEDGE_DEPTHS:
        f = block.normal_force(gap - depth)[order]
        found.append(wedge_errors(at, f / area, 2.0 * f.sum()))
    return np.array(found)


def wedge_errors(at: Float, p: Float, force: float) -> tuple[float, float]:
    """Force (N) over the closed form at equal a, less 1, and the L2 error of pressures p (n,) at x (n,) >= 0."""
    x = (np.arange(15_000) + 0.5) * 1e-4  # midpoints: the pressure is infinite at 0
    drawn = np.interp(x, at, p)
    a = np.sqrt(6.0 * (drawn @ x**2) / drawn.sum())
    same = force / (MODULUS * SLOPE)
    exact = MODULUS * SLOPE / np.pi * np.arccosh(np.maximum(1.0, same / x))
    return same / a - 1.0, distance(drawn, exact)


def own_path(count: int) -> float:
    """Force over the closed form at equal a, mean of depths, by the product's own mesher and symmetry."""
    legs = tuple(Leg(d, steps=1) for d in WEDGE_DEPTHS)
    problem = build(on_block(TIP, Isotropic(1.0, NU), count, legs, HEIGHT), margin=CANDIDATES)
    right = np.flatnonzero(problem.points.points[:, 0] >= 0.0)
    right = right[np.argsort(problem.points.points[right, 0])]
    at, area = problem.points.points[right, 0], problem.points.area[right]
    forces = [frame.state.force[:, 0] for frame in march(problem)]
    return 1.0 + float(np.mean([wedge_errors(at, f[right] / area, f.sum())[0] for f in forces]))


def cone(count: int, growth: float) -> Errors:
    """A quarter of a block, radii near 0.7 to 1 mm."""
    block = quarter_block(contact_axis(1.0, count, CONE, growth), graded(CONE, 1.0 / count, growth), NU, 1.3)
    radius = block.gap(lambda p: np.hypot(p[:, 0], p[:, 2]))
    square = block.gap(lambda p: p[:, 0] ** 2 + p[:, 2] ** 2)
    found = []
    for v in np.linspace(0.7, 1.0, 12):
        f = block.normal_force(SLOPE * (radius - 0.5 * np.pi * 0.96 * v))
        a = np.sqrt(3.0 * (f @ square) / f.sum())
        found.append((4.0 * f.sum() / (0.5 * np.pi * MODULUS * SLOPE * a**2) - 1.0, np.nan))
    return np.array(found)


def wavy(count: int) -> tuple[Body, Float, Float]:
    """Half a wavelength between mirrors, `count` points to it: body, gap (c,), sin^2(pi x) (c,) at the points."""
    depths = graded(2.0, 0.5 / count, 1.3)  # two wavelengths: what is left there is exp(-4 pi)
    mesh = mapped(box([np.linspace(0.0, 0.5, count + 1), 2.0 - depths[::-1]]), lambda p: p)
    half = body(mesh, Elasticity.of(1.0, NU), held_at(mesh, {"x-": [0], "x+": [0], "y-": [0, 1]}), "y+")
    profile = Wave(wavelength_mm=1.0, amplitude_mm=AMPLITUDE)
    gap = half.gap(lambda p: profile.profile(p[:, 0], 0.0 * p[:, 0]))
    return half, gap, half.gap(lambda p: np.sin(np.pi * p[:, 0]) ** 2)


def depth_for(half: Body, gap: Float, share: float) -> float:
    """Depth (mm) that gives the mean pressure `share` p*."""
    total = share * PEAK * half.surface.area.sum()
    return float(brentq(lambda d: half.normal_force(gap - d).sum() - total, 1e-6, 0.05, xtol=1e-12))


def wave(count: int) -> Errors:
    """Mean pressures from a quarter to three quarters of p*."""
    half, gap, square = wavy(count)
    place = half.surface.points[:, 0]
    order = np.argsort(place)
    x = np.linspace(0.0, 0.5, 8001)
    found = []
    for depth in np.linspace(depth_for(half, gap, 0.25), depth_for(half, gap, 0.75), 30):
        f = half.normal_force(gap - depth)
        share = f.sum() / (PEAK * half.surface.area.sum())
        s = 4.0 * (f @ square) / f.sum()
        exact = 2.0 * PEAK * np.cos(np.pi * x) * np.sqrt(np.maximum(0.0, share - np.sin(np.pi * x) ** 2))
        p = np.interp(x, place[order], (f / half.surface.area)[order])
        found.append((share / s - 1.0, distance(p, exact)))
    return np.array(found)


def full_contact(count: int) -> float:
    """Amplitude of the pressure over p* when all touches, by its part along cos(2 pi x)."""
    half, gap, square = wavy(count)
    f = half.normal_force(gap - depth_for(half, gap, 1.2))
    return float(2.0 * (f @ (1.0 - 2.0 * square)) / half.surface.area.sum() / PEAK)


EDGES = {"wedge, plane strain": (0.5, "logarithm at the tip"), "wave, plane strain": (1.0, "square-root edge")}
"""Rates of the pressure in L2, where it is taken, and what they are due to."""


def run(quick: bool) -> Result:
    """Three sizes of each."""
    growth, radii = (2.2, (3, 4, 5)) if quick else (1.6, (4, 6, 8))
    wedges, waves = ((5, 10, 20), (10, 20, 40)) if quick else ((5, 10, 20, 40), (20, 40, 80))
    studies: dict[str, tuple[Any, tuple[int, ...], str, float]] = {
        "wedge, plane strain": (wedge, wedges, "Johnson 1985, sec. 5.2; REFERENCES.md, 1.4", 0.07),
        "cone, 3D": (lambda n: cone(n, growth), radii, "Sneddon 1965; REFERENCES.md, 1.4", 0.07),
        "wave, plane strain": (wave, waves, "Westergaard 1939; REFERENCES.md, 1.6", 0.01),
    }
    rows, table, curves = [], [], {}
    for name, (measure, counts, source, seen) in studies.items():
        levels = [measure(n) for n in counts]
        sizes = 1.0 / np.array(counts)
        rows.append(judged("force", 1.0 + levels[-1][:, 0].mean(), name=name, source=source, seen=seen))
        errors = np.sqrt([np.mean(e**2, axis=0) for e in levels])
        curves[name] = sizes, errors
        table += [(name, n, *e) for n, e in zip(counts, errors, strict=True)]
        rows.append(judged("rate-of-the-force", rate(sizes, errors[:, 0]), name=name))
        if name in EDGES:
            theory, cause = EDGES[name]
            rows.append(judged("rate-of-the-pressure", rate(sizes, errors[:, 1]), theory, name=name, cause=cause))
    count = 10 if quick else 40
    rows.append(judged("force-of-own-path", own_path(count), count=count))
    rows.append(judged("amplitude-of-the-pressure", full_contact(20 if quick else 40)))
    names = "case points force_rms_error pressure_L2_error"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, curves))


def draw(figure: Any, curves: dict[str, tuple[Float, Float]]) -> None:
    """Errors of the force, and of the wave's and the wedge's pressure, over the point spacing."""
    figure.set_size_inches(12.0, 4.5)
    labels = "point spacing / a (wave: / half a wavelength)", "relative error, rms over depths"
    for axes, (name, (sizes, errors)) in zip(figure.subplots(1, 3), curves.items(), strict=True):
        convergence(axes, sizes, {"force at equal a": errors[:, 0]}, 2.0, *labels)
        if name in EDGES:
            convergence(axes, sizes, {"pressure, L2": errors[:, 1]}, EDGES[name][0], *labels)
        axes.set_title(name)
