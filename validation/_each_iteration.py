"""Reference solver as in Maeno 2004: one factorisation of the whole body in every contact iteration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, ContactProblem, project_on_friction_cone, residual
from finger3d.contact.friction import SLIP, STICK, Coulomb
from finger3d.contact.state import ContactState, next_state
from finger3d.mechanics.discretise.build import widened
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.path import targets

from ._common import free_motion
from ._cost import MU, rows_of


class EachIteration:
    """The paper's way with the product's iteration: each one solves the whole body again, sets and all.

    Unknowns are the body's and the forces of touching points: ``K u = R^T E x`` and ``T (free + R u) + D x = 0`` with E
    and T as in `finger3d.contact.newton.force_of_sets`; friction makes the matrix unsymmetric.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.solves = problem, 0
        body, active = problem.body, problem.system.active_dofs
        size = body.stiffness.upper.shape[0]
        self.free = np.setdiff1d(np.arange(size), body.fixed_dofs)
        upper = body.stiffness.upper[self.free][:, self.free]
        self.whole = (upper + sp.triu(upper, 1).T).tocsr()
        c, d = problem.surface.points.shape
        place = sp.csr_matrix((np.ones(len(active)), (active, np.arange(len(active)))), (c * d, len(active)))
        rows, self.gauges = (widened(part, size)[:, self.free] for part in rows_of(problem))
        self.read = (place @ rows).tocsr()
        self.locked = np.setdiff1d(np.arange(c * d), active)
        # any positive weight will do: a column of the finger below each point
        spring = problem.model.material.E_MPa * problem.surface.area / problem.model.mesh.size_mm  # type: ignore[attr-defined]
        self.rho = np.repeat(spring[:, None], d, axis=1)

    def run(self, count: int) -> dict[str, float]:
        """Force, friction sum and gauge strain after a press in so many increments."""
        problem = self.problem
        c, d = problem.surface.points.shape
        legs = tuple(replace(leg, steps=count) for leg in problem.model.legs)
        state = ContactState.at_rest(np.maximum(problem.gap(targets(legs)[0]), 0.0), d)
        for target in targets(legs):
            free = free_motion(problem, target)
            free[:, 1:] -= state.tangential_displacement
            increment = ContactProblem(
                previous=state,
                free_motion=free,
                delassus=np.zeros((0, 0)),
                law=Coulomb(MU),
                length_scale=target.depth_mm,
                friction=np.full(c, MU),
                augmentation=self.rho,
            )
            force, moved, status, u = self._settle(increment, state.force)
            state = next_state(state, force, moved, status)
        # a point on a symmetry plane carries its part's share of the force, like all others
        copies = 2.0 ** len(problem.axes)
        return {
            "force": float(copies * state.force[:, 0].sum()),
            "friction_sum": float(copies * np.linalg.norm(state.force[:, 1:], axis=1).sum()),
            "gauge_strain": float((self.gauges @ u)[0]),
        }

    def _settle(self, problem: ContactProblem, start: Float) -> tuple[Float, Float, NDArray[np.int8], Float]:
        force, moved = start, problem.free_motion.copy()
        if start.any():
            moved[start[:, 0] > 0.0] = 0.0
        for _ in range(60):
            _, status, trial = project_on_friction_cone(problem, force, moved)
            force, u = self._solve(problem, status, trial)
            moved = problem.free_motion + (self.read @ u).reshape(force.shape)
            if residual(force, moved, status, problem.friction, problem.length_scale) <= TOLERANCE:
                return force, moved, status, u
        raise ArithmeticError(f"no convergence at {problem.length_scale} mm")

    def _solve(self, problem: ContactProblem, status: NDArray[np.int8], trial: Float) -> tuple[Float, Float]:
        """Forces (c, d) and free unknowns (N,) that solve the equations of the sets: one factorisation."""
        from pypardiso import PyPardisoSolver

        expand, test, own = self._equations(status, trial)
        matrix = sp.bmat([[self.whole, -(expand @ self.read).T], [test @ self.read, sp.diags(own)]], format="csr")
        matrix.sort_indices()
        right = np.concatenate([np.zeros(len(self.free)), -(test @ problem.free_motion.ravel())])
        solver = PyPardisoSolver()
        x = solver.solve(matrix, right)
        solver.free_memory(everything=True)
        self.solves += 1
        return (expand.T @ x[len(self.free) :]).reshape(trial.shape), x[: len(self.free)]

    def _equations(self, status: NDArray[np.int8], trial: Float) -> tuple[sp.csr_matrix, sp.csr_matrix, Float]:
        """E, T and the diagonal of D; a sticking point has d unknowns, a slipping one f_n and, in 3D, f across."""
        c, d = trial.shape
        stick, slip = np.flatnonzero(status == STICK), np.flatnonzero(status == SLIP)
        length = np.linalg.norm(trial[slip, 1:], axis=1)
        length = np.where(length > 0.0, length, 1.0)
        e = trial[slip, 1:] / length[:, None]
        turn = np.minimum(MU * trial[slip, 0] / length, 1.0) if d == 3 else np.zeros(0)
        across = np.stack([-e[:, 1], e[:, 0]], axis=1) if d == 3 else np.zeros((0, 1))
        held, normal = (stick[:, None] * d + np.arange(d)).ravel(), slip * d
        side = (slip[:, None] * d + np.arange(1, d)).ravel()
        n, k, w = len(held), len(slip), len(turn)
        at_n, at_w = n + np.arange(k), np.repeat(n + k + np.arange(w), d - 1)
        beside = side[: w * (d - 1)]
        expand = _sparse(
            [np.ones(n + k), MU * e, across], [np.arange(n), at_n, np.repeat(at_n, d - 1), at_w],
            [held, normal, side, beside], (n + k + w, c * d),
        )  # fmt: skip
        test = _sparse(
            [np.ones(n + k), turn[:, None] * across], [np.arange(n), at_n, at_w], [held, normal, beside],
            (n + k + w, c * d),
        )  # fmt: skip
        own = np.zeros(n + k + w)
        own[:n][np.isin(held, self.locked)] = 1.0
        if w:
            own[n + k :] = (1.0 - turn) / self.rho[slip, -1]
        return expand, test, own


def _sparse(values: list[Float], rows: list[Any], columns: list[Any], shape: tuple[int, int]) -> sp.csr_matrix:
    data = np.concatenate([v.ravel() for v in values])
    return sp.csr_matrix((data, (np.concatenate(rows), np.concatenate(columns))), shape=shape)
