"""Is a bonded layer as stiff against a cylinder and a ball as its integral equation says, from thick to thin?

The finger is such a layer: soft, nearly incompressible and bonded to a base.  Source: the force and the depth at a
contact half-width or radius a follow from an integral equation, validation/REFERENCES.md, 1.7, which `_layer.py`
solves; nu = 0.3 and 1/2, thickness h, a/h = 0.1 to 2.  The indenter is pressed to the exact depth, and the forces are
compared.

Expected rate: the energy has an error of third order in the cell size (Brezzi, Hager and Raviart 1977, quadratic
elements), times a function of the position of the contact edge between two points.  The force is its derivative with
respect to depth: second order, oscillating about zero.  The root mean square over many depths is used; its rate is 2,
and higher in 3D, where the edge crosses many points at once.  The layer extends beyond a by 4 h at nu = 0.3 and by 8 h
at nu = 1/2, where it counts as infinite.
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
from finger3d.objects import Cylinder, Sphere

from ._common import body, contact_axis, convergence, graded, halved, quarter_block, rate
from ._layer import line, point
from ._rows import Result, Row, exact_columns, zero

RADIUS = 1e5  # of the indenter, in thicknesses: the theory neglects slopes, which add some a / R to the force
_LAYER = "Gladwell 1980; REFERENCES.md, 1.7"
_ONE = (
    "second order in the point spacing; 0.08 % or less measured at 5 to 40 points to a, and coarse meshes must pass too"
)
TABLE = {  # REFERENCES.md, 1.7, nu = 0.3: a/h -> P/P_Hertz, depth R/a^2
    "line": {0.1: (1.0071, 1.4960), 0.5: (1.1661, 0.8199), 1.0: (1.5556, 0.6540), 2.0: (2.5184, 0.5711)},
    "point": {0.1: (1.0005, 0.9421), 0.5: (1.0516, 0.7588), 1.0: (1.2589, 0.6476), 2.0: (1.8789, 0.5730)},
}
_BEYOND = {0.3: 4.0, 0.5: 8.0}  # width beyond the contact, in thicknesses
Errors = tuple[float, float]


def _legs(a: Float, nu: float, exact: Any) -> tuple[Leg, ...]:
    return tuple(Leg(exact(v, nu).depth * v**2 / RADIUS, steps=1) for v in a)


def _model(a: float, nu: float, sizes: tuple[float, float], indenter: Any, mesher: str, legs: tuple[Leg, ...]) -> Model:
    reach = a + _BEYOND[nu]
    flat = isinstance(indenter, Cylinder)
    block = designs()["block"](half_length_mm=reach, height_mm=1.0, width_mm=1.0 if flat else 2.0 * reach)
    mesh = MeshOptions(*sizes, mesher)
    return Model(block, Isotropic(1.0, nu), mesh, legs, object=indenter, domain="plane-strain" if flat else "solid")


def forces(model: Model) -> Float:
    """Forces (N) at the ends of the legs by the product's own path."""
    frames = list(march(build(model, margin=1.0)))
    return np.array([f.state.force[:, 0].sum() if f.outcome.ok else np.nan for f in frames])


def line_errors(a: float, nu: float, count: int) -> Errors:
    """Relative error of the force at a/h, and the root of the mean square from 0.7 a/h on; `count` points to a."""
    places = a * np.linspace(0.7, 1.0, 20)
    sizes = (a / count, max(a / count, 2.5 / count))
    found = forces(_model(a, nu, sizes, Cylinder(radius_mm=RADIUS), "swept", _legs(places, nu, line)))
    exact = np.array([line(v, nu).force for v in places]) * np.pi * places**2 / (4.0 * RADIUS * (1.0 - nu**2))
    away = found / exact - 1.0
    return float(away[-1]), float(np.sqrt(np.mean(away**2)))


def point_errors(a: float, nu: float, axes: tuple[Float, Float]) -> Errors:
    """The same under a ball, on a graded quarter of a square layer."""
    mesh, held = quarter_block(*axes)
    layer = body(mesh, Elasticity.of(1.0, nu), held, "y+", lambda p: np.hypot(p[:, 0], p[:, 2]) < 1.25 * a)
    square = layer.gap(lambda p: (p[:, 0] ** 2 + p[:, 2] ** 2) / (2.0 * RADIUS))
    away = []
    for v in a * np.linspace(0.7, 1.0, 12):
        exact = point(v, nu)
        state = layer.press(square - exact.depth * v**2 / RADIUS)
        force = 4.0 * state.state.force[:, 0].sum() if state.outcome.ok else np.nan
        away.append(force / (exact.force * 4.0 / 3.0 * v**3 / (RADIUS * (1.0 - nu**2))) - 1.0)
    return float(away[-1]), float(np.sqrt(np.mean(np.square(away))))


def point_levels(a: float, nu: float, levels: int) -> list[Errors]:
    """Errors with 2, 4, 8 points to a, each mesh the one before halved."""
    axes = contact_axis(a, 2, a + _BEYOND[nu] - 1.0), graded(1.0, a / 2.0, 1.6)
    found = []
    for _ in range(levels):
        found.append(point_errors(a, nu, axes))
        axes = halved(axes[0]), halved(axes[1])
    return found


def run(quick: bool) -> Result:
    """Lines by the product's own path, points on halved meshes; in full a ball through CAD and pytetwild, too."""
    rows: list[Row] = [_table_row()]
    table: list[tuple[Any, ...]] = []
    curves: dict[str, dict[str, Any]] = {"line": {}, "point": {}}
    counts = (5, 10, 20) if quick else (5, 10, 20, 40)
    lines = {0.3: (0.5, 1.0, 2.0), 0.5: (0.5, 2.0)} if quick else dict.fromkeys((0.3, 0.5), (0.1, 0.5, 1.0, 2.0))
    balls = {0.3: (2.0,), 0.5: ()} if quick else {0.3: (0.5, 1.0, 2.0), 0.5: (2.0,)}
    for nu in (0.3, 0.5):
        for kind, exact, places in (("line", line, lines[nu]), ("point", point, balls[nu])):
            slopes = []
            for a in places:
                if kind == "line":
                    sizes, found = [1.0 / n for n in counts], [line_errors(a, nu, n) for n in counts]
                else:
                    levels = 2 if a == 0.5 else 3
                    sizes, found = [1.0 / 2**n for n in range(1, levels + 1)], point_levels(a, nu, levels)
                table += [(kind, nu, a, round(1 / h), *e) for h, e in zip(sizes, found, strict=True)]
                wanted = exact(a, nu).force
                what = f"P/P_Hertz(a), {kind}, a/h = {a:g}, nu = {nu:g}"
                rows.append(Row(what, _LAYER, wanted, wanted * (1.0 + found[-1][0]), 0.01, _ONE))
                # a/h = 0.1: the mesher's growth of 0.25 governs, which does not shrink; depth < a^2/2R: the edge lies
                # beyond where the rigid indenter would overlap, in coarser cells
                fair = kind == "point" or (a >= 0.5 and exact(a, nu).depth > 0.5)
                if fair and len(sizes) > 2:
                    slopes.append(rate(sizes[-3:], [e[1] for e in found[-3:]]))
                    curves[kind][f"a/h = {a:g}, nu = {nu:g}"] = (sizes, [e[1] for e in found])
            if not slopes:
                continue
            what = f"rate of the force, {kind}, nu = {nu:g}, lowest over a/h"
            why = "the depths sample the position of the edge between two points; a higher rate passes"
            rows.append(Row(what, "Brezzi, Hager, Raviart 1977", 2.0, min(slopes), 0.15, why, measure="at least"))
    if not quick:
        rows.append(_own_path())
    names = "kind nu a_over_h points_per_a error_at_a rms_error"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, curves))


def _table_row() -> Row:
    """The integral equation solved by `_layer.py` against the table of REFERENCES.md, 1.7."""
    pairs = [
        (got, want)
        for kind, exact in (("line", line), ("point", point))
        for a, both in TABLE[kind].items()
        for got, want in zip((exact(a, 0.3).force, exact(a, 0.3).depth), both, strict=True)
    ]
    worst = max(abs(got / want - 1.0) for got, want in pairs)
    what = "integral equation of this study against the table, nu = 0.3, 16 values: largest relative difference"
    return zero(what, "REFERENCES.md, 1.7", worst, 2e-4, "the table has four decimals")


def _own_path() -> Row:
    """A ball on a square block, through CAD, pytetwild and symmetry."""
    a, nu = 1.0, 0.3
    legs = _legs(np.array([a]), nu, point)
    got = forces(_model(a, nu, (0.2, 0.8), Sphere(radius_mm=RADIUS), "ftetwild", legs))[-1]
    hertz = 4.0 / 3.0 * a**3 / (RADIUS * (1.0 - nu**2))
    what = "P/P_Hertz(a), point, a/h = 1, nu = 0.3, ftetwild, 5 points to a"
    return Row(what, _LAYER, point(a, nu).force, float(got / hertz), 0.01, _ONE)


def draw(figure: Any, curves: dict[str, dict[str, Any]]) -> None:
    """Errors over the point spacing."""
    for kind, axes in zip(curves, figure.subplots(1, 2), strict=True):
        sizes = next(iter(curves[kind].values()))[0]
        chosen = {name: e for name, (h, e) in curves[kind].items()}
        convergence(axes, sizes, chosen, 2.0, "point spacing / a", "error of the force at a depth, rms over depths")
        axes.set_title("cylinder, plane strain" if kind == "line" else "ball, 3D")
