"""Does friction hold a block at 99 % of mu N and let it go at 101 %, however the scene is turned?

Source: Code_Aster SSNV503 (validation/REFERENCES.md, 6.3 and 8.2).  A block lies on a rigid plane that is turned by 30
degrees, in 2D and 3D; in 3D the shear is turned by another 30 degrees about the normal.

A block held by friction alone can glide as a rigid body, and finger3d refuses a body without a fixed base.  So soft
springs tie it down.  They carry less than 1e-4 of the load while the block sticks; once it glides they carry what
friction does not, and the slip is that force over their stiffness.  The loads are the tractions of a uniform stress
(pressure p, then shear up to 1.01 mu p) on every face but the foot.  At nu = 0 a sticking block is in simple shear and
all points reach their limit together, which is the sharpest test.  At nu = 0.3 friction resists the lateral expansion,
so that the edges slip before the block glides, by an amount of the order of its own strain.

Finally, with a fixed base: a plate that slides on a block until all points slip transmits mu N and no more.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy import sparse

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.law import ContactLaw
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh.simplex import Mesh, quadratic
from finger3d.fem.solvers.condense import condense
from finger3d.fem.surface.traces import local_rows, surface
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure

from ._common import cube, side_load
from ._rows import Result, Row, at_most, exact_columns, zero

MU, PRESSURE, SPRINGS = 0.3, 0.01, 2e-5  # p/E, and the springs' stiffness over E, of a block of side 1
TURN = np.pi / 6.0
SHARES = (0.5, 0.9, 0.99, 1.01)
FREE = 0.99 * MU * PRESSURE / SPRINGS
"""Glide of the block at 99 % of mu N if there were no friction, which takes it back, over the side."""
SOURCE = "Code_Aster SSNV503; REFERENCES.md, 6.3"
ROUND_OFF = "round-off: some hundred times 2e-16 by the factorisation, another number on each processor"
CRITERION = "convergence criterion of finger3d: residual <= 1e-8"
COLUMNS = "dim nu shear_over_muN sticking slipping friction_over_muN mean_slip largest_slip iterations residual"
"""Slips over the block's side."""


def turned(dim: int) -> np.ndarray:
    """Rotation (d, d) by 30 degrees about z; in 3D then by 30 degrees about the block's own normal."""
    c, s = np.cos(TURN), np.sin(TURN)
    about_z = np.eye(dim)
    about_z[:2, :2] = [[c, -s], [s, c]]
    return about_z


def block(dim: int, nu: float, cells: int) -> list[tuple[Any, ...]]:
    """Rows of the table: the block under pressure and the shares of mu N in turn."""
    turn = turned(dim)
    straight = quadratic(cube(dim, cells))
    mesh = Mesh(straight.points @ turn.T, straight.cells, straight.facets)
    along = np.eye(dim)[0] if dim == 2 else np.array([np.cos(TURN), 0.0, np.sin(TURN)])
    up = np.eye(dim)[1]
    pressing = PRESSURE * -np.outer(up, up)
    shearing = MU * PRESSURE * (np.outer(along, up) + np.outer(up, along))
    foot = surface(mesh, "y-")
    frame = np.vstack([up, np.eye(dim)[[0, 2][: dim - 1]]]) @ turn.T
    loads = [_traction(mesh, turn @ stress @ turn.T, turn) for stress in (pressing, shearing)]
    rows = sparse.vstack([local_rows(foot, frame), sparse.csr_matrix(np.array(loads))], format="csr")
    soft = stiffness(mesh, Elasticity.of(1.0, nu))
    each = np.full(mesh.points.size, SPRINGS / len(mesh.points))
    condensed = condense(replace(soft, upper=(soft.upper + sparse.diags(each)).tocsr()), np.zeros(0, dtype=int), rows)
    c = len(foot.nodes)
    compliance = condensed.compliance[:-2, :-2].reshape(c, dim, c, dim)
    press, shear = (condensed.compliance[:-2, k].reshape(c, dim) for k in (-2, -1))
    state = ContactState.at_rest(np.zeros(c), dim)
    table = []
    for share in (0.0, *SHARES):
        found = solve_increment(
            ContactProblem.of(state, press + share * shear, compliance, ContactLaw(Coulomb(MU)), 1.0)
        )
        if not found.outcome.ok:
            raise AssertionError(f"{dim}D, nu = {nu:g}, {share:g} of mu N: {found.outcome}")
        state = found.state
        total = state.force.sum(axis=0)
        slip = np.linalg.norm(state.accumulated_slip, axis=1)
        table.append(
            (
                dim, nu, share, int((state.status == STICK).sum()), int((state.status == SLIP).sum()),
                float(np.linalg.norm(total[1:]) / (MU * total[0])), float(slip.mean()), float(slip.max()),
                found.iterations, found.residual,
            )
        )  # fmt: skip
    return table


def _traction(mesh: Mesh, stress: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Nodal loads (n d,) of a uniform stress on every side but the foot."""
    load = np.zeros_like(mesh.points)
    for label in mesh.facets:
        if label != "y-":
            outward = np.zeros(mesh.dim)
            outward["xyz".index(label[0])] = -1.0 if label[1] == "-" else 1.0
            pull = stress @ (turn @ outward)
            load += side_load(mesh, label, lambda p, pull=pull: np.tile(pull, (len(p), 1)))
    return load.ravel()


def plate(dim: int, size: float) -> tuple[list[tuple[float, float, float]], float]:
    """Slide (mm), Q/(mu P), angle of Q (degrees) on the way to full slip; and the share of points that slip at last."""
    design = designs()["block"](half_length_mm=5.0, height_mm=5.0, width_mm=10.0)
    domain = "plane-strain" if dim == 2 else "solid"
    far = (0.4, 0.0) if dim == 2 else (0.4 * np.cos(TURN), 0.4 * np.sin(TURN))
    legs = (Leg(0.2, steps=4), Leg(0.2, *far, steps=20))
    mesh = MeshOptions(size, 2.0 * size, "swept")
    problem = build(Model(design, Isotropic(1.0, 0.3), mesh, legs, friction=Coulomb(MU), domain=domain))
    curve, slipping = [], 0.0
    for frame in march(problem):
        if not frame.outcome.ok:
            raise AssertionError(f"plate, {dim}D, {frame.target}: {frame.outcome}")
        m = measure(problem.points, frame)
        q = np.array([m["tangential_force_x_N"], m["tangential_force_z_N"]])
        slide = float(np.hypot(m["slide_x_mm"], m["slide_z_mm"]))
        angle = float(np.degrees(np.arctan2(q[1], q[0]))) if slide else np.nan
        curve.append((slide, float(np.linalg.norm(q)) / (MU * m["normal_force_N"]), angle))
        status = frame.state.status
        slipping = float((status == SLIP).sum() / (status != OPEN).sum())
    return curve, slipping


def run(quick: bool) -> Result:
    """Blocks of 16 (2D) and 4 (3D) cells a side, and a plate sliding on a block with a fixed base."""
    flat, solid = (6, 2) if quick else (16, 4)
    table = [r for nu in (0.0, 0.3) for dim, cells in ((2, flat), (3, solid)) for r in block(dim, nu, cells)]
    rows = []
    glide = 0.01 * MU * PRESSURE / SPRINGS
    for dim, nu, share, stick, slip, friction, mean, largest, _, _ in table:
        here = f"{dim}D, nu = {nu:g}, shear {share:g} mu N"
        if share == 0.99:
            rows.append(
                Row(f"friction over mu N, {here}", SOURCE, 0.99, friction, 1e-4, "the springs carry up to 1e-4")
            )
            own = "a bound: the block's own strain p/E over the glide"
            what = f"mean slip over the glide (1.01 - 1) mu N/springs, {here}"
            rows.append(at_most(what, SOURCE, PRESSURE / glide, mean / glide, own))
        if share == 0.99 and nu == 0.0:
            rows.append(zero(f"points that slip, {here}", SOURCE, slip, 0, "must stick"))
            what = f"largest slip over the glide of {FREE:.0f} sides without friction, {here}"
            rows.append(zero(what, SOURCE, largest / FREE, 1e-12, ROUND_OFF))
        if share == 1.01:
            rows.append(zero(f"points that stick, {here}", SOURCE, stick, 0, "must slip"))
            rows.append(Row(f"friction over mu N, {here}", SOURCE, 1.0, friction, 1e-6, "limit of Coulomb's law"))
            what = f"mean slip over the glide, {here}"
            rows.append(
                Row(what, "equilibrium", 1.0, mean / glide, PRESSURE / glide, "the block's own strain over the glide")
            )
    worst = max(r[9] for r in table)
    rows.append(at_most("largest residual", CRITERION, 1e-8, worst))
    curves = {}
    for dim, size in ((2, 0.5), (3, 2.5 if quick else 1.25)):
        curves[dim], slipping = plate(dim, size)
        peak, last = max(q for _, q, _ in curves[dim]), curves[dim][-1][1]
        rows.append(Row(f"plate, {dim}D: largest Q/(mu P)", SOURCE, 1.0, peak, 1e-9, "round-off", measure="at most"))
        wide, why = (
            (1e-3, "round-off") if dim == 2 else (0.01, "some friction points sideways, because the block expands")
        )
        rows.append(Row(f"plate, {dim}D: Q/(mu P) when all slips", SOURCE, 1.0, last, wide, why))
        rows.append(Row(f"plate, {dim}D: share of points that slip at last", SOURCE, 1.0, slipping, 0.0, "all"))
    what, why = "plate, 3D: direction of Q, degrees from x", "the mesh is not symmetric about this direction"
    rows.append(
        Row(what, "isotropic friction; REFERENCES.md, 7.2", 30.0, curves[3][-1][2], 0.1, why, measure="absolute")
    )
    columns = exact_columns(COLUMNS, table)
    return Result(tuple(rows), columns, lambda figure: _draw(figure, columns, curves))


def _draw(figure: Any, columns: dict[str, list[Any]], curves: dict[int, list[tuple[float, float, float]]]) -> None:
    left, right = figure.subplots(1, 2)
    t = {k: np.array(v) for k, v in columns.items()}
    for dim in (2, 3):
        for nu, mark in ((0.0, "o"), (0.3, "s")):
            of = (t["dim"] == dim) & (t["nu"] == nu)
            share = t["sticking"][of] / (t["sticking"] + t["slipping"])[of]
            left.plot(t["shear_over_muN"][of], share, mark + "-", label=f"{dim}D, nu = {nu:g}")
    left.axvline(1.0, color="k", lw=0.8, ls="--")
    left.set(xlabel="shear load / mu N", ylabel="share of points that stick", title="block on soft springs")
    for dim, curve in curves.items():
        right.plot([s for s, _, _ in curve], [q for _, q, _ in curve], "o-", ms=3, label=f"{dim}D, base fixed")
    right.axhline(1.0, color="k", lw=0.8, ls="--")
    right.set(xlabel="slide, mm", ylabel="Q/(mu P)", title="plate sliding on a block")
