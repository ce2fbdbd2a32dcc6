"""Are bonded layers, strips and discs as stiff as theory says, where rubber is stiff by its shape alone?

The finger is such a layer: soft, nearly incompressible and bonded to a base.  Layers are pressed by a cylinder and a
ball.  Source: the force and the depth at a contact half-width or radius a follow from an integral equation,
validation/REFERENCES.md, 1.7, which `_layer.py` solves; nu = 0.3 and 1/2, thickness h, a/h = 0.1 to 2.  The indenter is
pressed to the exact depth, and the forces are compared.  Expected rate: the energy has an error of third order in the
cell size (Brezzi, Hager and Raviart 1977, quadratic elements), times a function of the position of the contact edge
between two points.  The force is its derivative with respect to depth: second order, oscillating about zero.  The root
mean square over many depths is used; its rate is 2, and higher in 3D, where the edge crosses many points at once.  The
layer extends beyond a by 4 h at nu = 0.3 and by 8 h at nu = 1/2, where it counts as infinite.

Strips and discs are bonded between two plates.  Source: the problem of Gent and Lindley 1959, with the values of
validation/REFERENCES.md, 5.5: the apparent modulus E_a/E = force x thickness/(area x approach x E) of a strip (plane
strain, half-width/thickness 1) and of a disc (radius/(2 thickness) 1).  Expected rate: at the rim of the bond the
displacement goes as r^e (Williams 1952, 90 degrees between a clamped and a free side), so the force converges as
h^(2e), 1.19 at nu = 1/2.  The value compared is extrapolated with that rate.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh import Mesh
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.objects import Cylinder, Sphere

from ._common import (
    box,
    contact_axis,
    convergence,
    graded,
    halved,
    held_at,
    mapped,
    nodes_of,
    quarter_block,
    rate,
    solve,
)
from ._corner import clamped_free, extrapolated, observed
from ._layer import line, point
from ._press import converged
from ._rows import Result, Row, exact_columns, listed, together

judged = listed(__file__)

RADIUS = 1e5  # of the indenter, in thicknesses: the theory neglects slopes, which add some a / R to the force

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
    return np.array([frame.state.force[:, 0].sum() for frame in converged(build(model, margin=1.0))])


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
    layer = quarter_block(*axes, nu, 1.25 * a)
    square = layer.gap(lambda p: (p[:, 0] ** 2 + p[:, 2] ** 2) / (2.0 * RADIUS))
    away = []
    for v in a * np.linspace(0.7, 1.0, 12):
        exact = point(v, nu)
        force = 4.0 * layer.normal_force(square - exact.depth * v**2 / RADIUS).sum()
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


def _layer(quick: bool) -> Result:
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
                rows.append(judged("force-on-layer", wanted * (1.0 + found[-1][0]), wanted, kind=kind, a=a, nu=nu))
                # a/h = 0.1: the mesher's growth of 0.25 governs, which does not shrink; depth < a^2/2R: the edge lies
                # beyond where the rigid indenter would overlap, in coarser cells
                fair = kind == "point" or (a >= 0.5 and exact(a, nu).depth > 0.5)
                if fair and len(sizes) > 2:
                    slopes.append(rate(sizes[-3:], [e[1] for e in found[-3:]]))
                    curves[kind][f"a/h = {a:g}, nu = {nu:g}"] = (sizes, [e[1] for e in found])
            if slopes:
                rows.append(judged("rate-of-the-force", min(slopes), kind=kind, nu=nu))
    if not quick:
        rows.append(_own_path())
    names = "kind nu a_over_h points_per_a error_at_a rms_error"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw_layer(figure, curves))


def _table_row() -> Row:
    """The integral equation solved by `_layer.py` against the table of REFERENCES.md, 1.7."""
    pairs = [
        (got, want)
        for kind, exact in (("line", line), ("point", point))
        for a, both in TABLE[kind].items()
        for got, want in zip((exact(a, 0.3).force, exact(a, 0.3).depth), both, strict=True)
    ]
    return judged("integral-equation", max(abs(got / want - 1.0) for got, want in pairs))


def _own_path() -> Row:
    """A ball on a square block, through CAD, pytetwild and symmetry."""
    a, nu = 1.0, 0.3
    legs = _legs(np.array([a]), nu, point)
    got = forces(_model(a, nu, (0.2, 0.8), Sphere(radius_mm=RADIUS), "ftetwild", legs))[-1]
    hertz = 4.0 / 3.0 * a**3 / (RADIUS * (1.0 - nu**2))
    return judged("force-on-layer-by-ftetwild", got / hertz, point(a, nu).force)


def draw_layer(figure: Any, curves: dict[str, dict[str, Any]]) -> None:
    """Errors over the point spacing."""
    for kind, axes in zip(curves, figure.subplots(1, 2), strict=True):
        sizes = next(iter(curves[kind].values()))[0]
        chosen = {name: e for name, (h, e) in curves[kind].items()}
        convergence(axes, sizes, chosen, 2.0, "point spacing / a", "error of the force at a depth, rms over depths")
        axes.set_title("cylinder, plane strain" if kind == "line" else "ball, 3D")


DIGITS = {
    "strip": "the reference has four digits, and the last may be off by one",
    "disc": "the last digit of the reference and a coarser mesh",
}
WANTED = {("strip", 0.5): 2.6695, ("strip", 0.49): 2.448, ("disc", 0.5): 2.955, ("disc", 0.49): 2.6337}


def strip(count: int) -> Mesh:
    """Quarter of the strip: half-width 1, half thickness 1/2, `count` square cells through that."""
    return mapped(box([np.linspace(0.0, 1.0, 2 * count + 1), np.linspace(0.0, 0.5, count + 1)]), lambda p: p)


def disc(count: int) -> Mesh:
    """Eighth of the disc: radius 1, half thickness 1/4, `count` cells (even) to half the radius."""
    side = np.linspace(0.0, 1.0, 2 * count + 1)

    def rounded(p: Float) -> Float:
        x, z = p[:, 0], p[:, 2]
        return np.stack([x * np.sqrt(1.0 - 0.5 * z**2), p[:, 1], z * np.sqrt(1.0 - 0.5 * x**2)], axis=1)

    return mapped(box([side, np.linspace(0.0, 0.25, count // 2 + 1), side]), rounded)


def apparent_modulus(mesh: Mesh, nu: float) -> float:
    """E_a / E from the force on the bonded face."""
    d = mesh.dim
    sides = {"x-": [0], "y-": [1], "y+": range(d)} | ({"z-": [2]} if d == 3 else {})
    bonded = nodes_of(mesh, "y+")
    value = np.zeros(mesh.points.shape)
    value[bonded, 1] = -1.0
    found = solve(mesh, Elasticity.of(1.0, nu), held_at(mesh, sides), value)
    area = 1.0 if d == 2 else np.pi / 4.0
    return float(-found.reaction[bonded, 1].sum() * mesh.points[:, 1].max() / area)


def _strip_and_disc(quick: bool) -> Result:
    """Three sizes and more, uniform."""
    counts = {"strip": (8, 16, 32) if quick else (8, 16, 32, 64), "disc": (4, 6, 8) if quick else (4, 8, 12)}
    rows, table = [], []
    errors: dict[str, dict[str, list[float]]] = {"strip": {}, "disc": {}}
    for (shape, nu), wanted in WANTED.items():
        if quick and (shape, nu) == ("disc", 0.49):
            continue
        sizes = [1.0 / n for n in counts[shape]]
        found = [apparent_modulus((strip if shape == "strip" else disc)(n), nu) for n in counts[shape]]
        theory = 2.0 * clamped_free(np.pi / 2, nu)
        limit = extrapolated(found[-2], found[-1], theory, sizes[-2] / sizes[-1])
        errors[shape][f"nu = {nu:g}"] = [v / limit - 1.0 for v in found]
        table += [(shape, nu, n, v) for n, v in zip(counts[shape], found, strict=True)]
        rows.append(judged("e-a-over-e", limit, wanted, shape=shape, nu=nu, why=DIGITS[shape]))
        allowed = 0.05 if shape == "strip" else 0.15
        rows.append(judged("rate-of-e-a", observed(sizes, found), theory, allowed, shape=shape, nu=nu))
    names = "body nu cells apparent_modulus_over_E"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw_strip_and_disc(figure, counts, errors))


def draw_strip_and_disc(figure: Any, counts: dict[str, tuple[int, ...]], errors: dict[str, Any]) -> None:
    """Errors over the cell size."""
    for shape, axes in zip(errors, figure.subplots(1, 2), strict=True):
        sizes = 0.5 / np.array(counts[shape])
        theory = 2.0 * clamped_free(np.pi / 2, 0.5)
        labels = "cell size / half-width (radius)", "E_a over its extrapolated value, less 1"
        convergence(axes, sizes, errors[shape], theory, *labels)
        kind = "strip, plane strain, half-width/thickness 1" if shape == "strip" else "disc, 3D, radius/(2 thickness) 1"
        axes.set_title(f"bonded {kind}")


def run(quick: bool) -> Result:
    """Layers under a cylinder and a ball; strips and discs of three sizes and more."""
    return together((10.0, 9.0), layer=_layer(quick), strip_and_disc=_strip_and_disc(quick))
