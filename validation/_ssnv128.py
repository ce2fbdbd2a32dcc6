"""Does a square that loads push along a rigid plane stick and slip as in Code_Aster's SSNV128?

Source: Code_Aster V6.04.128, a benchmark of the GRECO (validation/REFERENCES.md, 6.1).  Plane strain, 40 x 40 mm, E =
130 GPa, nu = 0.2, mu = 1, a rigid plane under the foot y = 0.  A pressure of 150 MPa acts on the left side and one of
50 MPa on the top; the right side is held along x, and its foot also along y.  Both loads grow together.

No object is pressed on this body.  It is condensed to the contact points of its foot and to one row for the loads, and
the increments are passed to `solve_increment` directly; `free` is the displacement that the loads alone would cause.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy import sparse

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import Coulomb
from finger3d.contact.solve import maeno_active_set, solve_increment
from finger3d.contact.state import ContactState
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import quadratic
from finger3d.fem.solvers.condense import Condensation, condense
from finger3d.fem.surface import BoundarySurface, local_rows, surface

from ._common import box, held_at, nodes_of, side_load
from ._rows import Result, Row, exact_columns, listed

judged = listed(__file__)

SIDE, LEFT, TOP = 40.0, 150.0, 50.0  # mm, MPa
PLACES = np.array([0.0, 1.25, 5.0, 7.5, 11.25])  # mm
ASTER = np.array([28.6, 27.2, 22.8, 19.8, 15.0])  # um
NEWTON_96 = np.array([28.60, 27.22, 22.87, 19.81, 15.41])  # um
FRICTIONLESS = 40.62  # um, at x = 0
COLUMNS = "cells_per_side increments mu rule ux_0 ux_1.25 ux_5 ux_7.5 ux_11.25 iterations residual settled_increments"


class Square:
    """The condensed square: foot, compliance (c, 2, c, 2), and what the full loads alone do there (c, 2)."""

    def __init__(self, cells: int) -> None:
        axis = np.linspace(0.0, SIDE, cells + 1)
        self.mesh = quadratic(box([axis, axis]))
        held = held_at(self.mesh, {"x+": (0,)})
        held[np.all(self.mesh.points == [SIDE, 0.0], axis=1)] = True
        load = side_load(self.mesh, "x-", lambda p: np.tile([LEFT, 0.0], (len(p), 1)))
        load += side_load(self.mesh, "y+", lambda p: np.tile([0.0, -TOP], (len(p), 1)))
        self.foot: BoundarySurface = surface(self.mesh, "y-")
        # normal into the body: up
        rows = local_rows(self.foot, np.array([[0.0, 1.0], [1.0, 0.0]]))
        rows = sparse.vstack([rows, sparse.csr_matrix(load.reshape(1, -1))], format="csr")
        matrix = stiffness(self.mesh, Elasticity.of(1.3e5, 0.2))
        self.condensed: Condensation = condense(matrix, np.flatnonzero(held.ravel()), rows)
        c = len(self.foot.nodes)
        self.compliance = self.condensed.compliance[:-1, :-1].reshape(c, 2, c, 2)
        self.loaded = self.condensed.compliance[:-1, -1].reshape(c, 2)
        self.line = nodes_of(self.mesh, "y-")

    def slide(self, state: ContactState) -> np.ndarray:
        """u_x at PLACES, um, of the nodes under contact forces and full loads."""
        u = self.condensed.unknowns(np.append(state.force.ravel(), 1.0))[: self.mesh.points.size].reshape(-1, 2)
        x = self.mesh.points[self.line, 0]
        order = np.argsort(x)
        return 1e3 * np.interp(PLACES, x[order], u[self.line, 0][order])

    def load(self, mu: float, count: int, rule: str = "projection") -> tuple[tuple[Any, ...], ContactState]:
        """A row of the table, and the state under the full loads."""
        state = ContactState.at_rest(np.zeros(len(self.foot.nodes)), 2)
        iterations, worst, settled = 0, 0.0, 0
        for k in range(1, count + 1):
            step = {"projection": solve_increment, "paper": maeno_active_set}[rule]
            found = step(ContactProblem.of(state, k / count * self.loaded, self.compliance, Coulomb(mu), 1e-3 * SIDE))
            state, settled = found.state, settled + found.outcome.ok
            iterations, worst = max(iterations, found.iterations), max(worst, found.residual)
        ux = self.slide(state)
        return (round(np.sqrt(len(self.mesh.cells) / 2)), count, mu, rule, *ux, iterations, worst, settled), state


def run(quick: bool) -> Result:
    """Squares of 12 to 96 cells a side, 1 to 20 increments, the paper's rule beside."""
    meshes = (8, 16, 32) if quick else (12, 24, 48, 96)
    table, last, state = [], None, None
    for cells in meshes:
        last = Square(cells)
        row, state = last.load(1.0, 5)
        table += [last.load(0.0, 1)[0], row, last.load(1.0, 5, "paper")[0]]
    table += [last.load(1.0, count)[0] for count in (1, 20)]
    rows = _rows(table, meshes, [last.load(1.0, count)[1] for count in (1, 5, 20)])
    return Result(tuple(rows), exact_columns(COLUMNS, table), lambda figure: _draw(figure, last, state))


def _rows(table: list[tuple[Any, ...]], meshes: tuple[int, ...], states: list[ContactState]) -> Iterator[Row]:
    fine = meshes[-1]
    got = np.array(next(r for r in table if r[:4] == (fine, 5, 1.0, "projection"))[4:9], dtype=float)
    for k, x in enumerate(PLACES):
        yield judged("u-x-at-mm-um", got[k], ASTER[k], x=x)
    for k, x in enumerate(PLACES):
        yield judged("u-x-at-mm-um-cells", got[k], NEWTON_96[k], x=x, fine=fine)
    smooth = next(r for r in table if r[:4] == (fine, 1, 0.0, "projection"))[4]
    yield judged("u-x-at-0-mm-um", smooth, FRICTIONLESS)
    force = max(float(np.abs(s.force).max()) for s in states)
    apart = max(float(np.abs(s.force - states[0].force).max()) for s in states) / force
    yield judged("forces-after-1-5-and-20", apart)
    worst = max(r[10] for r in table if r[3] == "projection")
    yield judged("largest-residual", worst)
    values = [next(r for r in table if r[:4] == (n, 5, 1.0, "projection"))[4] for n in meshes]
    steps = np.abs(np.diff(values))
    rate = float(np.log2(steps[0] / steps[-1]) / (len(steps) - 1))
    yield judged("rate-at-which-u-x-at", rate)
    literal = next(r for r in table if r[:4] == (fine, 5, 1.0, "paper"))
    yield judged("increments-of-5-that-the-paper", literal[11], fine=fine)


def _draw(figure: Any, square: Square, state: ContactState) -> None:
    axes = figure.subplots()
    x = square.foot.points[:, 0]
    order = np.argsort(x)
    axes.plot(x[order], 1e3 * state.tangential_displacement[order, 0], label=f"finger3d, {len(x) - 1} cells a side")
    axes.plot(PLACES, ASTER, "k+", ms=10, label="SSNV128")
    axes.set(xlabel="x, mm", ylabel="u_x, um", title="slide of the foot")
