"""What did the paper's coarse mesh and its literal swap rule get right, and what wrong?

Source: Maeno 2004, Sec. II-A and Fig. 1: 96 nodes, 108 elements, nodes held in contact; every node that violates Eqs.
(1)-(4) is changed, and the system is solved again.  96 nodes and 108 elements fit neither triangles alone (about 150
elements) nor quadrilaterals alone (about 75), and the text does not describe Fig. 1.  This study uses linear triangles
with 96 nodes or the nearest possible number, and contact node by node, as in the paper.  The reference is a mesh of
quadratic elements of 0.05 mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import OPEN, STICK, Coulomb
from finger3d.contact.solve import maeno_active_set, solve_increment
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import Mesh, unfold
from finger3d.fem.recovery import displacement
from finger3d.fem.solvers.condense import Condensation, condense
from finger3d.fem.surface import strain_row
from finger3d.geometry.design import designs
from finger3d.meshing.grid import Sizes, rows

from ._paper import MUS, STRAIN, STRESS, Profile, half_cylinder, line_r5, pressed, said, strains
from ._rows import Result, Row, columns

CASES = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.45), (STRAIN, 0.49))
RULES = {"swap": maeno_active_set, "projection": solve_increment}
NODES = 96


def linear_mesh(nodes: int) -> Mesh:
    """Linear triangles of the half cylinder, with the number of nodes nearest to `nodes`."""
    section = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0).section()
    found = []
    for size in np.linspace(0.3, 2.0, 171):
        grid = rows(section, Sizes(size, size, 0.0, 5.0))
        found.append(unfold(Mesh(grid.points, grid.triangulated()[0], grid.facets), (0,))[0])
    return min(found, key=lambda mesh: abs(len(mesh.points) - nodes))


@dataclass(frozen=True)
class Coarse:
    """The body seen from its contact nodes."""

    mesh: Mesh
    nodes: np.ndarray
    condensed: Condensation

    @classmethod
    def of(cls, mesh: Mesh, plane: str, nu: float) -> Coarse:
        """Condense to the nodes of the arc; the normal is -y, the tangent +x."""
        base = np.unique(mesh.facets["base"])
        nodes = np.setdiff1d(mesh.facets["contact"], base)
        nodes = nodes[np.argsort(mesh.points[nodes, 0])]
        number = np.arange(len(nodes))
        read = sp.csr_matrix((np.ones(len(nodes)), (number, nodes)), shape=(len(nodes), len(mesh.points)))
        held = (base[:, None] * 2 + np.arange(2)).ravel()
        matrix = stiffness(mesh, Elasticity.of(1.0, nu, plane == STRESS, mixed=False))
        return cls(mesh, nodes, condense(matrix, held, sp.kron(read, [[0.0, -1.0], [1.0, 0.0]], format="csr")))

    def press(self, mu: float, rule: str) -> list[ContactSolution]:
        """Ten increments of .1 mm; a rule that fails hands on what it has."""
        count = len(self.nodes)
        compliance = self.condensed.compliance.reshape(count, 2, count, 2)
        top = 5.0 - self.mesh.points[self.nodes, 1]
        state = ContactState.at_rest(top, 2)
        found = []
        for step in range(1, 11):
            free = np.stack([top - 0.1 * step, np.zeros(count)], axis=1)
            found.append(RULES[rule](ContactProblem.of(state, free, compliance, Coulomb(mu), 0.1 * step)))
            state = found[-1].state
        return found

    def shear(self, state: ContactState, x: np.ndarray) -> np.ndarray:
        """gamma_xy (n,) along the line, constant in each triangle."""
        u = displacement(self.mesh, self.condensed.unknowns(state.force.ravel())).ravel()
        y = np.sqrt(4.5**2 - x**2)
        half = np.sqrt(0.5)
        directions = np.array([[1.0, 0.0], [half, half], [0.0, 1.0]])
        points = np.stack([x, y], axis=1)
        read = [[float((strain_row(self.mesh, p, d) @ u)[0]) for d in directions] for p in points]
        along_x, slanted, along_y = np.array(read).T
        return 2.0 * slanted - along_x - along_y


def run(quick: bool) -> Result:
    """Coarse and fine, both rules, all coefficients."""
    mesh = linear_mesh(NODES)
    found, lines, made = {}, [], []
    x, gauges = line_r5(count=15)
    for plane, nu in CASES:
        body, fine = Coarse.of(mesh, plane, nu), half_cylinder(nu, plane, 0.2 if quick else 0.05, gauges)
        for mu in MUS:
            frame = pressed(fine, mu)[-1]
            profile = Profile.of(fine, frame)
            found[plane, nu, mu, "fine"] = (profile, strains(frame, len(x))[2])
            lines.append((plane, nu, mu, "fine", profile.force, profile.a, profile.c, profile.friction, 0, 0.0))
            for rule in RULES:
                steps = body.press(mu, rule)
                found[plane, nu, mu, rule] = (body, steps)
                force, a, c, friction = _numbers(body, steps[-1].state)
                failed = sum(not s.outcome.ok for s in steps)
                lines.append((plane, nu, mu, rule, force, a, c, friction, failed, max(s.residual for s in steps)))
        made += _statements(plane, nu, x, found)
    names = "plane nu mu rule force_N_per_mm a_mm c_mm friction_sum_N_per_mm steps_not_settled residual"
    return Result(tuple(made), columns(names, lines), lambda figure: _draw(figure, x, found))


def _numbers(body: Coarse, state: ContactState) -> tuple[float, float, float, float]:
    """Force, half-widths by the outermost nodes, sum of |friction|."""
    x = np.abs(body.mesh.points[body.nodes, 0])
    a, c = (float(x[on].max(initial=0.0)) for on in (state.status != OPEN, state.status == STICK))
    return float(state.force[:, 0].sum()), a, c, float(np.abs(state.force[:, 1]).sum())


def _statements(plane: str, nu: float, x: np.ndarray, found: dict[Any, Any]) -> list[Row]:
    here = f"{plane}, nu = {nu:g}"
    fine, shear = found[plane, nu, 0.25, "fine"]
    body, steps = found[plane, nu, 0.25, "swap"]
    force, _, c, friction = _numbers(body, steps[-1].state)
    coarse = body.shear(steps[-1].state, x)
    unsettled = sum(not s.outcome.ok for mu in MUS for s in found[plane, nu, mu, "swap"][1])
    best = found[plane, nu, 0.25, "projection"][1][-1].state
    spacing = float(np.diff(np.sort(body.mesh.points[body.nodes, 0])).max())
    against = f"coarse mesh and swaps against fine, {here}"
    return [
        said("coarse-force", force, wanted=fine.force, against=against),
        said("coarse-stick", c, wanted=fine.c, tolerance=spacing, against=against),
        said("coarse-friction", friction, wanted=fine.friction, against=against),
        said("coarse-shear", np.abs(coarse - shear).max() / np.abs(shear).max(), against=against),
        said("swaps-unique", unsettled, here=here),
        said("swaps-as-projection", friction, wanted=float(np.abs(best.force[:, 1]).sum()), here=here),
    ]


def _draw(figure: Any, x: np.ndarray, found: dict[Any, Any]) -> None:
    figure.set_size_inches(13.0, 8.4)
    panels = figure.subplots(3, len(CASES), sharex=True)
    body = found[(*CASES[0], 0.25, "swap")][0]
    counts = f"{len(body.mesh.points)} nodes, {len(body.mesh.cells)} linear triangles"
    figure.suptitle(f"Circles: {counts} and swaps; lines: quadratic elements of .05 mm; 1 mm, mu = .25")
    for column, (plane, nu) in zip(panels.T, CASES, strict=True):
        profile, shear = found[plane, nu, 0.25, "fine"]
        body, steps = found[plane, nu, 0.25, "swap"]
        where = body.mesh.points[body.nodes]
        length = np.gradient(np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(where, axis=0).T))]))
        traction = steps[-1].state.force / length[:, None]
        for axes, fine_x, fine, coarse_x, coarse, colour in (
            (column[0], profile.x, profile.p, where[:, 0], traction[:, 0], "#222222"),
            (column[1], profile.x, profile.q, where[:, 0], traction[:, 1], "#c0392b"),
            (column[2], x, shear, x, body.shear(steps[-1].state, x), "#2c5d8f"),
        ):
            axes.axhline(0.0, color="#999999", lw=0.7)
            axes.plot(fine_x, fine, color=colour)
            axes.plot(coarse_x, coarse, "o", color=colour, mfc="none", ms=6)
        column[0].set_title(f"{plane}, nu = {nu:g}")
        column[2].set(xlabel="x (mm)", xlim=(-4.2, 4.2))
    for axes, label in zip(panels[:, 0], ("f_n (MPa)", "f_t (MPa)", "gamma_xy .5 mm deep"), strict=True):
        axes.set_ylabel(label)
