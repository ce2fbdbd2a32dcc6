"""Does a ball on a deep block show Hertz's force, pressure and contact radius, and how fast do they converge in 3D?

Source: Hertz's solution (validation/REFERENCES.md, 1.1).  The block is 10 a high, which changes P(a) by 0.05 % and the
force at equal depth by 10 %, so forces are compared at equal a.  a is found from the second moment of the forces, a^2 =
(5/2) times the mean of r^2 weighted with p.  The linear fit of p^2 over r^2 that serves in 2D needs more than the 8
points to a that are affordable here (its error is 10 %).

Expected rates: pressures are piecewise linear, and the best approximation of the square-root edge has an error of first
order in the point spacing h in L2; moments of the pressure converge like the force, with second order (see
bonded_layer), or faster where the edge crosses many cells.  The root mean square over 12 depths is used.  The body is a
quarter of a graded box; one case of the full study goes through CAD, pytetwild and symmetry.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.objects import Sphere

from ._common import body, contact_axis, convergence, graded, quarter_block, rate
from ._layer import point
from ._rows import Result, Row, exact_columns

RADIUS = 1000.0  # a = 1
HEIGHT = 10.0
PLACES = np.linspace(0.7, 1.0, 12)
_HERTZ = "Johnson 1985, sec. 4.2; REFERENCES.md, 1.1"
_ONE = "second order in the point spacing; 0.08 % or less measured, and coarse meshes must pass too"


def depth(a: float, nu: float) -> float:
    """Depth (mm) for about this radius: the bonded layer's."""
    return point(a / HEIGHT, nu).depth * a**2 / RADIUS


def force_at(a: float, nu: float) -> float:
    """Hertz's force (N) at a radius."""
    return 4.0 / 3.0 * a**3 / (RADIUS * (1.0 - nu**2))


def measured(nu: float, count: int) -> Float:
    """Per depth: P/P_Hertz(a) by the moment, and the pressure's L2 error at the points over Hertz's own norm."""
    mesh, held = quarter_block(contact_axis(1.0, count, HEIGHT), graded(HEIGHT, 1.0 / count, 1.6))
    block = body(mesh, Elasticity.of(1.0, nu), held, "y+", lambda p: np.hypot(p[:, 0], p[:, 2]) < 1.3)
    square = block.gap(lambda p: p[:, 0] ** 2 + p[:, 2] ** 2)
    place = (block.surface.points[:, [0, 2]] ** 2).sum(axis=1)
    found = []
    for v in PLACES:
        state = block.press(square / (2.0 * RADIUS) - depth(v, nu))
        f = state.state.force[:, 0] if state.outcome.ok else np.full(len(square), np.nan)
        force = 4.0 * f.sum()
        a = np.sqrt(2.5 * (f @ square) / f.sum())
        same = (force / force_at(1.0, nu)) ** (1.0 / 3.0)
        hertz = 1.5 * force / (np.pi * same**2) * np.sqrt(np.maximum(0.0, 1.0 - place / same**2))
        area = block.surface.area
        away = np.sqrt(area @ (f / area - hertz) ** 2 / (area @ hertz**2))
        found.append((force / force_at(a, nu), away))
    return np.array(found)


def own_path(nu: float, count: int) -> float:
    """P/P_Hertz(a), mean over depths, by the product's own path: CAD, pytetwild, a quarter by symmetry."""
    block = designs()["block"](half_length_mm=HEIGHT, height_mm=HEIGHT, width_mm=2.0 * HEIGHT)
    legs = tuple(Leg(depth(v, nu), steps=1) for v in PLACES)
    model = Model(block, Isotropic(1.0, nu), MeshOptions(1.0 / count, 4.0), legs, Sphere(radius_mm=RADIUS))
    problem = build(model)
    samples = problem.surface.samples
    square = (problem.surface.average @ (samples[:, 0] ** 2 + samples[:, 2] ** 2))[problem.symmetry.image_of]
    ratios = []
    for frame in march(problem):
        f = frame.state.force[:, 0] if frame.outcome.ok else np.full(len(square), np.nan)
        ratios.append(f.sum() / force_at(float(np.sqrt(2.5 * (f @ square) / f.sum())), nu))
    return float(np.mean(ratios))


def run(quick: bool) -> Result:
    """Quarter blocks of three sizes."""
    cases = {0.3: (3, 4, 5)} if quick else {0.3: (4, 6, 8), 0.5: (4, 6, 8)}
    rows, table, curves = [], [], {}
    for nu, counts in cases.items():
        levels = [measured(nu, n) for n in counts]
        sizes = 1.0 / np.array(counts)
        got = float(levels[-1][:, 0].mean())
        rows.append(
            Row(f"P/P_Hertz(a), nu = {nu:g}, {counts[-1]} points to a, mean of 12 depths", _HERTZ, 1.0, got, 0.01, _ONE)
        )
        errors = np.array([np.sqrt([np.mean((e[:, 0] - 1.0) ** 2), np.mean(e[:, 1] ** 2)]) for e in levels])
        table += [(nu, n, *e) for n, e in zip(counts, errors, strict=True)]
        curves[nu] = (sizes, errors)
        why = "12 depths sample the position of the edge between points; a higher rate passes"
        for column, kind, source, theory in (
            (0, "P(a), rms", "h^2, as the force", 2.0),
            (1, "the pressure in L2", "square-root edge", 1.0),
        ):
            got = rate(sizes, errors[:, column])
            rows.append(Row(f"rate of {kind}, nu = {nu:g}", source, theory, got, 0.15, why, measure="at least"))
    if not quick:
        what = "P/P_Hertz(a), nu = 0.3, ftetwild, 5 points to a, mean of 12 depths"
        rows.append(Row(what, _HERTZ, 1.0, own_path(0.3, 5), 0.01, _ONE))
    names = "nu points_per_a force_rms_error pressure_L2_error"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, curves))


def draw(figure: Any, curves: dict[float, tuple[Float, Float]]) -> None:
    """Errors over the point spacing."""
    sizes = next(iter(curves.values()))[0]
    for column, theory, label, axes in zip(
        (0, 1),
        (2.0, 1.0),
        ("P(a)/P_Hertz(a) less 1, rms over depths", "pressure, relative L2 error"),
        figure.subplots(1, 2),
        strict=True,
    ):
        convergence(
            axes,
            sizes,
            {f"nu = {nu:g}": e[:, column] for nu, (_, e) in curves.items()},
            theory,
            "point spacing / a",
            label,
        )
