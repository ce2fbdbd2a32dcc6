"""Reference solver as in Maeno 2004: one factorisation of the whole body in every contact iteration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, ContactLaw, ContactProblem, project_on_friction_cone, residual
from finger3d.contact.friction import Coulomb
from finger3d.contact.newton import ActiveSet
from finger3d.contact.state import ContactState, next_state
from finger3d.mechanics.discretise.build import widened
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.path import targets

from ._common import free_motion
from ._cost import MU, rows_of


class EachIteration:
    """The paper's way with the product's iteration: each one solves the whole body again, sets and all.

    Unknowns are the body's and the forces of touching points: ``K u = R^T P x`` and ``D (free + R u) + diag(1 - a) x =
    0`` with P, D and a as in `finger3d.contact.newton.ActiveSet`; friction makes the matrix unsymmetric.
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
                law=ContactLaw(Coulomb(MU)),
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

        active = ActiveSet.of(problem, status, trial)
        forces, weights = active.force_matrix(), active.weight_matrix(problem.augmentation)
        own = np.zeros(active.size)
        own[np.flatnonzero(np.isin(active.active_dofs, self.locked))] = 1.0
        own[len(active.active_dofs) :] = 1.0 - active.turning if active.is_3d else []
        matrix = sp.bmat([[self.whole, -(self.read.T @ forces)], [weights @ self.read, sp.diags(own)]], format="csr")
        matrix.sort_indices()
        right = np.concatenate([np.zeros(len(self.free)), -(weights @ problem.free_motion.ravel())])
        solver = PyPardisoSolver()
        x = solver.solve(matrix, right)
        solver.free_memory(everything=True)
        self.solves += 1
        return active.force(x[len(self.free) :]), x[: len(self.free)]
