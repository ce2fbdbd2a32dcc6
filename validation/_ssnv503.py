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

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import sparse

from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.state import ContactState
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh import Mesh, quadratic
from finger3d.fem.solvers.condense import condense
from finger3d.fem.surface import local_rows, surface
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.model import Leg
from finger3d.objects.rigid import rotation

from ._common import cube, increment, side_load
from ._press import block_model, converged
from ._rows import Result, Row, exact_columns, grouped, listed

judged = listed(__file__)

MU, PRESSURE, SPRINGS = 0.3, 0.01, 2e-5  # p/E, and the springs' stiffness over E, of a block of side 1
TURN = np.pi / 6.0
SHARES = (0.5, 0.9, 0.99, 1.01)
FREE = 0.99 * MU * PRESSURE / SPRINGS
"""Glide of the block at 99 % of mu N if there were no friction, which takes it back, over the side."""

COLUMNS = "dim nu shear_over_muN sticking slipping friction_over_muN mean_slip largest_slip iterations residual"
"""Slips over the block's side."""


def turned(dim: int) -> np.ndarray:
    """Rotation (d, d) by 30 degrees about z; in 3D then by 30 degrees about the block's own normal."""
    return rotation(0.0, 0.0, TURN)[:dim, :dim]


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
        found = increment(state, press + share * shear, compliance, MU, 1.0)
        if not found.outcome.ok:
            raise AssertionError(f"{dim}D, nu = {nu:g}, {share:g} of mu N: {found.outcome}")
        state = found.state
        total = state.force.sum(axis=0)
        slip = np.linalg.norm(state.accumulated_slip, axis=1)
        stick, slips = (int((state.status == one).sum()) for one in (STICK, SLIP))
        friction = float(np.linalg.norm(total[1:]) / (MU * total[0]))
        slid = friction, float(slip.mean()), float(slip.max())
        table.append((dim, nu, share, stick, slips, *slid, found.iterations, found.residual))
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
    domain = "plane-strain" if dim == 2 else "solid"
    far = (0.4, 0.0) if dim == 2 else (0.4 * np.cos(TURN), 0.4 * np.sin(TURN))
    legs = (Leg(0.2, steps=4), Leg(0.2, *far, steps=20))
    more = {"friction": Coulomb(MU), "domain": domain}
    problem = build(block_model((5.0, 5.0, 10.0), Isotropic(1.0, 0.3), (size, 2.0 * size), legs, **more))
    curve, slipping = [], 0.0
    for frame in converged(problem):
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
    curves = {dim: plate(dim, size) for dim, size in ((2, 0.5), (3, 2.5 if quick else 1.25))}
    rows = (*_block_rows(table), *_plate_rows(curves))
    columns = exact_columns(COLUMNS, table)
    return Result(
        rows, columns, lambda figure: _draw(figure, columns, {dim: curve for dim, (curve, _) in curves.items()})
    )


def _block_rows(table: list[tuple[Any, ...]]) -> Iterator[Row]:
    glide = 0.01 * MU * PRESSURE / SPRINGS
    for dim, nu, share, stick, slip, friction, mean, largest, _, _ in table:
        here = f"{dim}D, nu = {nu:g}, shear {share:g} mu N"
        if share == 0.99:
            yield judged("friction-over-mu-n", friction, here=here)
            yield judged("mean-slip-over-the-glide-1", mean / glide, PRESSURE / glide, here=here)
        if share == 0.99 and nu == 0.0:
            yield judged("points-that-slip", slip, here=here)
            yield judged("largest-slip-over-the-glide-of", largest / FREE, FREE=FREE, here=here)
        if share == 1.01:
            yield judged("points-that-stick", stick, here=here)
            yield judged("friction-when-gliding", friction, here=here)
            yield judged("mean-slip-over-the-glide", mean / glide, tolerance=PRESSURE / glide, here=here)
    yield judged("largest-residual", max(line[9] for line in table))


def _plate_rows(curves: dict[int, tuple[list[tuple[float, float, float]], float]]) -> Iterator[Row]:
    sideways = "some friction points sideways, because the block expands"
    for dim, wide, why in ((2, 1e-3, "round-off"), (3, 0.01, sideways)):
        curve, slipping = curves[dim]
        peak, last = max(q for _, q, _ in curve), curve[-1][1]
        yield judged("plate-d", peak, dim=dim)
        yield judged("plate-when-all-slips", last, tolerance=wide, dim=dim, why=why)
        yield judged("plate-d-2", slipping, dim=dim)
    angle = curves[3][0][-1][2]
    yield judged("plate-3d", angle)


def _draw(figure: Any, columns: dict[str, list[Any]], curves: dict[int, list[tuple[float, float, float]]]) -> None:
    left, right = figure.subplots(1, 2)
    for (dim, nu), t in grouped(columns, "dim", "nu"):
        share = t["sticking"] / (t["sticking"] + t["slipping"])
        left.plot(t["shear_over_muN"], share, "s-" if nu else "o-", label=f"{dim}D, nu = {nu:g}")
    left.axvline(1.0, color="k", lw=0.8, ls="--")
    left.set(xlabel="shear load / mu N", ylabel="share of points that stick", title="block on soft springs")
    for dim, curve in curves.items():
        right.plot([s for s, _, _ in curve], [q for _, q, _ in curve], "o-", ms=3, label=f"{dim}D, base fixed")
    right.axhline(1.0, color="k", lw=0.8, ls="--")
    right.set(xlabel="slide, mm", ylabel="Q/(mu P)", title="plate sliding on a block")
