"""Do irregular patches reproduce the fields that quadratic elements hold, and does a flat press give a flat pressure?

Source: validation/REFERENCES.md, 5.1.  A displacement field that the elements contain must be reproduced exactly (Irons
and Razzaque 1972; Taylor, Simo, Zienkiewicz and Chan 1986): linear fields on any patch; on cells with straight edges
also u = (x^2 + yz, y^2 - xz, z^2 + xy) under b = -(4G + 2 lam)(1, 1, 1).  Contact has its own patch test (Crisfield
2000): a block between flat plates must have a uniform pressure.  There is no rate: the error is round-off at every cell
size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh import Mesh, quadratic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model

from ._common import body, body_load, cube, held_at, shuffled, solve, ticks_at
from ._rows import Result, exact_columns, zero

_PATCH = "Irons and Razzaque 1972; REFERENCES.md, 5.1"
_CONTACT = "Crisfield 2000; REFERENCES.md, 5.1"
_ROUND = "round-off of some thousand unknowns"
_NEAR = "round-off, multiplied by lam/G = 5000"
_PRESS = "round-off of the condensation; 3e-12 or less measured"
_FLOOR = (
    "with PARDISO round-off grows with lam/G (here 1e7) on few cells, with SuperLU it does not (the row above); "
    "limiting lam at nu = 1/2 changes results by 1e-7 anyway"
)
SHEAR_AND_STRETCH = np.array([[0.7, -0.3, 0.2], [0.5, 0.4, -0.6], [-0.1, 0.8, -0.9]])


def patch(dim: int, count: int) -> Mesh:
    """Quadratic mesh of the unit square or cube whose inner vertices are moved by up to a quarter of a cell."""
    return quadratic(shuffled(cube(dim, count), 0.25, seed=count))


def linear(mesh: Mesh, elastic: Elasticity) -> float:
    """Largest error of a linear field held on the boundary."""
    exact = mesh.points @ SHEAR_AND_STRETCH[: mesh.dim, : mesh.dim].T
    held = held_at(mesh, {side: range(mesh.dim) for side in mesh.facets})
    return float(np.abs(solve(mesh, elastic, held, exact).u - exact).max())


def quadratic_field(mesh: Mesh, elastic: Elasticity) -> float:
    """Largest error of a quadratic field held on the boundary."""
    x, y, z = np.vstack([mesh.points.T, np.zeros((3 - mesh.dim, len(mesh.points)))])
    exact = np.stack([x**2 + y * z, y**2 - x * z, z**2 + x * y], axis=1)[:, : mesh.dim]
    # -b = G laplace u + (lam + G) grad div u, and both of these are (2, 2, 2); in 2D (z = 0) likewise
    force = np.full(mesh.dim, -(4.0 * elastic.shear + 2.0 * elastic.lame))
    load = body_load(mesh, lambda p: np.tile(force, (len(p), 1)))
    held = held_at(mesh, {side: range(mesh.dim) for side in mesh.facets})
    return float(np.abs(solve(mesh, elastic, held, exact, load).u - exact).max())


def flat_press(mesh: Mesh, elastic: Elasticity, solver: str | None = None) -> float:
    """Largest relative difference of the pressure between smooth flat plates from the uniform one."""
    d, depth = mesh.dim, 0.01
    # sideways free but for rigid motions, which symmetry planes take
    sides = {"y-": [1], "x-": [0]} | ({"z-": [2]} if d == 3 else {})
    found = body(mesh, elastic, held_at(mesh, sides), "y+", solver=solver)
    force = found.normal_force(np.full(len(found.surface.nodes), -depth))
    g, lam = elastic.shear, elastic.lame
    young = g * (3 * lam + 2 * g) / (lam + g)
    want = depth * (young if d == 3 else 4 * g * (lam + g) / (lam + 2 * g))
    return float(np.abs(force / found.surface.area / want - 1.0).max())


def fixed_block(mesher: str, domain: str) -> float:
    """The same by the product's own path, CAD and mesher included; with nu = 0 the fixed base is not felt."""
    design = designs()["block"](half_length_mm=10.0, height_mm=8.0, width_mm=12.0)
    mesh, legs = MeshOptions(2.0, 4.0, mesher), (Leg(0.4, steps=2),)
    problem = build(Model(design, Isotropic(2.0, 0.0), mesh, legs, friction=Coulomb(0.25), domain=domain))
    *_, last = march(problem)
    pressure = last.state.force[:, 0] / problem.points.area
    return float(np.abs(pressure / (2.0 * 0.4 / 8.0) - 1.0).max()) if last.outcome.ok else np.inf


_Case = tuple[str, int, Callable[[Mesh], float], float, str]


def cases() -> Iterator[_Case]:
    """What is measured on every patch: name, dimension, measurement, tolerance, reason."""
    half, soft = Elasticity.of(1.0, 0.5), Elasticity.of(1.0, 0.3)
    for dim in (2, 3):
        yield "linear field, nu = 0.3 (mm)", dim, lambda m: linear(m, soft), 1e-12, _ROUND
        mixed = Elasticity.of(1.0, 0.3, mixed=True)
        yield "linear field, mixed form, nu = 0.3 (mm)", dim, lambda m, e=mixed: linear(m, e), 1e-12, _ROUND
        near = Elasticity.of(1.0, 0.4999)
        yield "linear field, mixed form, nu = 0.4999 (mm)", dim, lambda m, e=near: linear(m, e), 1e-11, _NEAR
        yield "quadratic field, nu = 0.3 (mm)", dim, lambda m: quadratic_field(m, soft), 1e-12, _ROUND
        yield "flat press, nu = 0.3 (relative pressure)", dim, lambda m: flat_press(m, soft), 1e-10, _PRESS
        name = "flat press, nu = 0.5 (relative pressure)"
        yield f"{name}, SuperLU", dim, lambda m: flat_press(m, half, "superlu"), 1e-10, _PRESS
        yield name, dim, lambda m: flat_press(m, half), 1e-7, _FLOOR
    stress = Elasticity.of(1.0, 0.3, plane_stress=True)
    yield "linear field, plane stress, nu = 0.3 (mm)", 2, lambda m: linear(m, stress), 1e-12, _ROUND


def run(quick: bool) -> Result:
    """Patches of three sizes, and the product's own path."""
    counts = {2: (2, 4, 8), 3: (1, 2, 3)} if quick else {2: (4, 8, 16, 32), 3: (2, 4, 8)}
    rows, table = [], []
    for name, dim, measure, tolerance, reason in cases():
        errors = [measure(patch(dim, n)) for n in counts[dim]]
        table += [(name, dim, n, e) for n, e in zip(counts[dim], errors, strict=True)]
        source = _CONTACT if "press" in name.split(",")[0] else _PATCH
        rows.append(zero(f"{name}, {dim}D: largest error", source, max(errors), tolerance, reason))
    paths = [("swept", "plane-strain"), ("swept", "solid")] + ([] if quick else [("ftetwild", "solid")])
    for mesher, domain in paths:
        what = f"flat press of a fixed block, nu = 0, mu = 0.25, {domain}, {mesher} (relative pressure): largest error"
        rows.append(zero(what, _CONTACT, fixed_block(mesher, domain), 1e-10, _PRESS))
    names = "case dim cells_per_side error"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, table))


def draw(figure: Any, table: list[tuple[str, int, int, float]]) -> None:
    """Errors over the number of cells."""
    for dim, axes in zip((2, 3), figure.subplots(1, 2, sharey=True), strict=True):
        for case in dict.fromkeys(t[0] for t in table if t[1] == dim):
            n, e = np.array([(t[2], t[3]) for t in table if t[:2] == (case, dim)]).T
            axes.loglog(n, np.maximum(e, 1e-17), "o-", markersize=4.5, label=case)
        axes.axhline(1e-12, color="k", linestyle="--", linewidth=1.0)
        ticks_at(axes, n)
        axes.set(xlabel="cells along a side", title=f"{dim}D patch tests (dashed: 1e-12)", ylim=(1e-17, 1e-2))
    figure.axes[0].set_ylabel("largest error (mm, or relative pressure)")
