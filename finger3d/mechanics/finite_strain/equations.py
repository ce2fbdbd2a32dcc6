"""Equations of one increment of contact at finite strain, linearised at one configuration and checked at another.

At displacements u with internal forces R(u), tangent K, contact rows B(u) and contact forces f, the next forces f' and
displacements u' solve ::

    u' = u + K^-1 (B^T f' - R),    contact conditions of f' and of the gaps and slips at u, moved by B (u' - u)

The forces are total, not increments, so that f = 0 in an open point.  K and B may be those of another configuration:
the residual is that of the present one, so that the solution does not depend on them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, ContactProblem, augmentation_parameters, residual
from finger3d.contact.solve import RULES
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.assembly import on_places
from finger3d.fem.recovery import displacement
from finger3d.fem.solvers.condense import condense
from finger3d.fem.surface import DeformedContact
from finger3d.fem.tensors import InvertedError, rotated_delassus
from finger3d.mechanics.discretise.problem import Problem, scatter_to_points
from finger3d.mechanics.finite_strain.body import (
    DeformedBody,
    FiniteBody,
    FiniteStrainWorkspace,
    Linearisation,
    contact_of,
    curvature_of,
)
from finger3d.mechanics.formulation import length_scale
from finger3d.mechanics.history import State
from finger3d.mechanics.small_strain import advanced, carried_by_object, motion_until_touch, transported
from finger3d.objects import Move, vertical_frame

_NEGLIGIBLE = 1e-6
"""Force, over the shear modulus times the square of the depth or of an edge of the mesh, below which contact is
negligible, or round-off."""

_LARGEST_STEP, _LEAST_STEP = 2.0, 0.05
"""Largest displacement in an iteration over that of the object, and the least over the depth that is always allowed."""

_LEAST_COST, _FACTOR_COST = 5.0, 0.03
"""Iterations that take as long as a factorisation: in small bodies, and over the unknowns to the power of 1/2 in
sections, 2/3 in solids; measured 6 in sections with 9 000 unknowns, 27 in solids with 30 000."""

NEW_TANGENT = 4
"""Iterations until convergence with a new tangent."""

_STEP_LENGTHS = (1.0, 0.5, 0.25, 0.125)
"""Fractions of a step tried in the line search."""


@dataclass(frozen=True)
class Configuration:
    """Unknowns x (N,), internal forces (N,) and contact of the deformed surface there."""

    x: Float
    internal: Float
    contact: DeformedContact


@dataclass(frozen=True)
class IncrementEquations:
    """Equations of an increment from a state, as the object moves.

    Attributes
    ----------
    body : over the time of the increment, if it relaxes
    start : state at the beginning
    workspace : holds the last linearisation
    """

    problem: Problem
    body: FiniteBody
    start: State[DeformedBody]
    move: Move
    workspace: FiniteStrainWorkspace

    def has_converged(self, error: float, last_error: float) -> bool:
        """Whether an iteration ends at a residual, after another one."""
        return error <= self.workspace.target or 0.3 * last_error < error <= TOLERANCE

    def remaining(self, errors: Sequence[float]) -> float:
        """Return the number of iterations until convergence, if the residual falls as in the last two."""
        last = [error for error in errors[-3:] if math.isfinite(error)]
        if len(last) < 2:
            return 0.0 if math.isfinite(errors[-1]) else math.inf
        fall = math.log(last[0] / last[-1]) / (len(last) - 1)
        return math.log(last[-1] / self.workspace.target) / fall if fall > 0.0 else math.inf

    @cached_property
    def factor_cost(self) -> float:
        """Iterations that take as long as a factorisation and the assembly of a tangent."""
        pieces = 1 if self.problem.system.second is None else 2
        cost: float = _FACTOR_COST * (self.start.body.unknowns.size / pieces) ** (1.0 - 1.0 / self.problem.dim)
        return max(_LEAST_COST, cost)

    def finished(
        self, now: Configuration, solution: ContactSolution[ContactState], error: float, spent: int
    ) -> ContactSolution[State[DeformedBody]]:
        """Return the solution with the state at the end, unless the material law is unstable there."""
        if self.body.instability(now.x):
            return self.failed(now, Outcome.UNSTABLE, error, spent)
        state, error = self.reached(now, solution.state), max(solution.residual, error)
        return replace(solution.with_state(state), residual=error, iterations=spent)

    def failed(
        self, now: Configuration, outcome: Outcome, error: float, spent: int, detail: str = ""
    ) -> ContactSolution[State[DeformedBody]]:
        """Return the initial state and the reason of the failure; later increments begin with a new tangent."""
        last = self.workspace.linearisations.get(self._has_inclusions)
        if last is not None:
            self.workspace.linearisations[self._has_inclusions] = replace(last, reusable=False)
        unstable = self.body.instability(now.x)
        outcome = Outcome.UNSTABLE if unstable else outcome
        return ContactSolution(self.start, outcome, error, spent, "none", unstable or detail)

    def last_linearisation(self) -> Linearisation | None:
        """Return the linearisation that an earlier increment left; None if it must not be reused."""
        last = self.workspace.linearisations.get(self._has_inclusions)
        return last if last is not None and last.reusable else None

    @property
    def _has_inclusions(self) -> bool:
        return self.body.bars is not None

    @cached_property
    def _until_touch(self) -> Float:
        return motion_until_touch(self.problem, self.start, self.move)

    @cached_property
    def length_scale(self) -> float:
        """The length (mm) that gaps are divided by."""
        return length_scale(self.problem, self.move)

    @cached_property
    def motion(self) -> float:
        """Largest displacement (mm) of the object's material at a contact point."""
        problem = self.problem
        u = problem.surface.trace @ displacement(problem.mesh, self.start.body.unknowns)
        return float(np.abs(carried_by_object(problem, self.move, u)).max(initial=0.0))

    @cached_property
    def _largest_step(self) -> float:
        """Largest displacement (mm) of an iteration: a multiple of that of the object, or a share of the depth."""
        return max(_LARGEST_STEP * self.motion, _LEAST_STEP * self.length_scale)

    @cached_property
    def _least_force(self) -> float:
        """Smallest force (N) by which the residual is divided; without contact all forces are round-off."""
        before = float(np.linalg.norm(self.start.contact.force, axis=1).max())
        shear, width = self.body.solid.material.law.shear, self.body.solid.thickness
        length = max(self.length_scale, self.problem.model.mesh.size_mm)
        area = length * (width if self.problem.dim == 2 else length)
        return max(before, _NEGLIGIBLE * shear * area)

    @cached_property
    def _augmentation(self) -> Float:
        delassus = self.problem.delassus
        c, d = delassus.shape[:2]
        return augmentation_parameters(delassus.reshape(c * d, c * d), d)

    def initial(self, guess: Float | None, expected: Float | None = None) -> tuple[Configuration, Float]:
        """Return the configuration and the contact forces (c, d) where the iteration begins, N.

        It is at expected unknowns (N,), else at extrapolated ones, else at those of the start.
        """
        force = self.start.contact.force if guess is None else guess
        for x in self._extrapolated() if expected is None else [expected]:
            try:
                return self.at(x), force
            except InvertedError:
                continue
        return self.at(self.start.body.unknowns), force

    def _extrapolated(self) -> Iterator[Float]:
        """Yield unknowns (N,) at which the increment may end, if the path continues as before."""
        start = self.start
        unknowns = start.body.unknowns
        if start.body.previous is not None:
            before, x = start.body.previous
            ratio = self.move.length_ratio(before)
            if ratio is not None:
                yield unknowns + ratio * (unknowns - x)

    def at(self, x: Float) -> Configuration:
        """Return the configuration at unknowns (N,); raises InvertedError."""
        problem = self.problem
        contact = contact_of(problem, problem.surface, displacement(problem.mesh, x), self.move.end)
        return Configuration(x, self.body.internal_forces(x), contact)

    def moved(self, now: Configuration, step: Float, force: Float) -> tuple[Configuration, Float]:
        """Return the configuration after a step (N,) and what is out of balance there (N,), under forces (c, d) N.

        A step is at most as long as the largest one.  One that would be longer and leads up in energy, as it does where
        the tangent has a negative eigenvalue beyond a limit point of the path, is reversed.  It is halved where it
        inverts a cell, and where the energy rises more steeply at its end than it falls at its beginning (Matthies and
        Strang 1979).

        Raises
        ------
        InvertedError
            If even the shortest fraction inverts a cell.
        """
        n = self.problem.mesh.points.size

        largest = float(np.abs(step[:n]).max())
        whole = min(1.0, self._largest_step / largest) if largest else 1.0
        fall = -float(step[:n] @ self.out_of_balance(now, force)[:n])
        if fall < 0.0:
            step, fall = (-step, -fall) if whole < 1.0 else (step, math.inf)
        after = None
        for length in _STEP_LENGTHS:
            try:
                after = self.at(now.x + whole * length * step)
            except InvertedError:
                continue
            unbalanced = self.out_of_balance(after, force)
            if float(step[:n] @ unbalanced[:n]) <= fall:
                break
        if after is None:
            raise InvertedError
        return after, unbalanced

    def linearise(self, now: Configuration, force: Float, damping: float = 0.0, local: bool = False) -> Linearisation:
        """Factor the tangent under contact forces (c, d), and keep the factor for later increments.

        Parameters
        ----------
        damping : multiple of the linear stiffness of the displacements that is added
        local : whether the curvature of the object is that of its facets, see `curvature_of`
        """
        problem, pattern, tangent = self.problem, self.body.contact_rows, self.body.tangent(now.x)
        active = problem.system.active_dofs
        rows, reads, turning = now.contact.rows[active], np.arange(len(active)), None
        if problem.system.object_compliance is None:
            u = displacement(problem.mesh, now.x)
            curvature = curvature_of(problem, problem.surface, u, self.move.end, local)
            geometric = now.contact.geometric_stiffness(force[:, 0], curvature)
            tangent = tangent.less(geometric)
            turning = None if curvature is None else geometric
        else:  # the gap is not read along the rows of the forces, since its normal turns
            normals = np.flatnonzero(active % problem.dim == 0)
            moved = self.displacement_of_object(now.contact.bases, force)
            rows = sp.vstack([rows, now.contact.gap_rows(moved)[active[normals] // problem.dim]], format="csr")
            pattern = sp.vstack([pattern, pattern[normals]], format="csr")
            reads[normals] = len(active) + np.arange(len(normals))
        rows = sp.csr_matrix((on_places(rows, pattern), pattern.indices, pattern.indptr), pattern.shape)
        if damping:
            n = problem.mesh.points.size
            tangent = tangent.less(-damping * problem.body.stiffness.upper[:n, :n])
        last = self.workspace.linearisations.pop(self._has_inclusions, None)
        replaced = last.condensation if last else None
        condensed = condense(tangent, problem.body.fixed_dofs, rows, replaced=replaced)
        self.workspace.factorizations += condensed.factorizations
        delassus = scatter_to_points(condensed.compliance[reads], active, *force.shape)
        linearisation = Linearisation(condensed, reads, now.contact.bases, delassus, turning, not damping)
        self.workspace.linearisations[self._has_inclusions] = linearisation
        return linearisation

    def contact(
        self,
        now: Configuration,
        force: Float,
        linearisation: Linearisation,
        displacement: Float,
        turned: Float | None = None,
    ) -> tuple[Self, ContactSolution[ContactState], Float]:
        """Solve contact of the linearised body.

        Parameters
        ----------
        displacement : (r,) mm, of the rows that are read, under the forces out of balance alone
        turned : (r, k) of these rows, as the forces turn with the object, by each free coordinate of its pose

        Returns
        -------
        increment : with the motion that the solution is for
        solution : of the contact
        change : (r,) N, of the forces on the rows
        """
        problem, start, bases = self.problem, transported(self.start.contact, now.contact.bases), now.contact.bases
        active, rotation = problem.system.active_dofs, linearisation.rotation(bases)
        delassus = rotated_delassus(linearisation.delassus, rotation)
        compliance = problem.system.object_compliance
        if compliance is not None:
            delassus = delassus + rotated_delassus(compliance, bases @ vertical_frame(problem.dim).T)

        def at_points(read: Float) -> Float:
            moved = np.zeros(force.size)
            moved[active] = read
            return self.active(np.einsum("cij,cj->ci", rotation, moved.reshape(force.shape)).ravel())

        free_displacement = self.relative_displacement(now, force) + at_points(displacement)
        free_displacement -= (delassus.reshape(force.size, force.size) @ force.ravel()).reshape(force.shape)
        free_displacement[:, 1:] += start.tangential_displacement
        law, area = problem.model.friction, problem.surface.area
        contact = ContactProblem.of(start, free_displacement, delassus, law, self.length_scale, area)
        contact = replace(contact, augmentation=self._augmentation, is_definite=False)
        turning = np.zeros((force.size, 0 if turned is None else turned.shape[1]))
        for k, one in enumerate([] if turned is None else turned.T):
            turning[:, k] = at_points(one).ravel()
        increment, solution = self._solved(now, force, contact, turning)
        change = np.einsum("cij,ci->cj", rotation, solution.state.force - force)
        return increment, solution, change.ravel()[active]

    def _solved(
        self, now: Configuration, force: Float, contact: ContactProblem, turned: Float
    ) -> tuple[Self, ContactSolution[ContactState]]:
        """Return the contact solution from a guess of the forces (c, d), N, and the increment that it is for."""
        return self, RULES[self.problem.model.rule](contact, force)

    def out_of_balance(self, now: Configuration, force: Float) -> Float:
        """Return internal less contact forces (N,)."""
        out = now.internal.copy()
        out[: self.problem.mesh.points.size] -= now.contact.nodal_forces(self.active(force.ravel())).ravel()
        return out

    def active(self, vector: Float) -> Float:
        """Return a vector (c d,) as (c, d), zero across symmetry planes.

        The weighted mean over half of a point's hat need not be zero there.
        """
        out = np.zeros(len(vector))
        out[self.problem.system.active_dofs] = vector[self.problem.system.active_dofs]
        return out.reshape(-1, self.problem.dim)

    def relative_displacement(self, now: Configuration, force: Float) -> Float:
        """Gap and increment of tangential displacement (c, d) under forces (c, d), in the present directions.

        Points that close in the increment slip from where they touch.
        """
        problem, bases = self.problem, now.contact.bases
        u, before = (problem.surface.trace @ displacement(problem.mesh, x) for x in (now.x, self.start.body.unknowns))
        increment = u - before - carried_by_object(problem, self.move, u) - self._until_touch
        of_object, start = self.displacement_of_object(bases, force), self.start.contact
        increment += of_object - self.displacement_of_object(start.own_bases, start.force)
        out = np.empty_like(force)
        out[:, 0] = now.contact.gap + np.einsum("ck,ck->c", bases[:, 0], of_object)
        out[:, 1:] = np.einsum("ctk,ck->ct", bases[:, 1:], increment)
        return self.active(out.ravel())

    def displacement_of_object(self, bases: Float, force: Float) -> Float:
        """Return the displacement (c, d), mm, of the object away from the finger, under forces (c, d) at the points."""
        frame, compliance = vertical_frame(self.problem.dim), self.problem.system.object_compliance
        if compliance is None:
            return np.zeros(force.shape)
        upright = np.einsum("ca,cak->ck", force, bases) @ frame.T
        return np.asarray((compliance.reshape(force.size, force.size) @ upright.ravel()).reshape(force.shape) @ frame)

    def residual(self, now: Configuration, solution: ContactState, out_of_balance: Float) -> float:
        """Return the largest violation of contact conditions, equilibrium and p = K (J - 1), dimensionless.

        Lengths are divided by the depth, forces by the largest at a contact point, p by the shear modulus.  The
        friction coefficients are those that the contact solution has used.
        """
        problem, force = self.problem, solution.force
        mesh, n = problem.mesh, problem.mesh.points.size
        normal, tangential = force[:, 0], np.linalg.norm(force[:, 1:], axis=1)
        mu = tangential / np.where(normal > 0.0, normal, 1.0)
        unbalanced = out_of_balance.copy()
        unbalanced[problem.body.fixed_dofs] = 0.0
        largest = max(float(np.linalg.norm(force, axis=1).max()), self._least_force)
        equilibrium = float(np.abs(unbalanced[:n]).max()) / largest
        volume = float(np.abs(np.linalg.det(np.diff(mesh.points[mesh.cells[:, : mesh.dim + 1]], axis=1))).mean())
        volume *= problem.body.thickness / math.factorial(mesh.dim) * self.body.solid.pressure_scale
        dilatation = float(np.abs(unbalanced[n:]).max(initial=0.0)) / volume
        moved = self.relative_displacement(now, force)
        return max(residual(force, moved, solution.status, mu, self.length_scale), equilibrium, dilatation)

    def reached(self, now: Configuration, solution: ContactState) -> State[DeformedBody]:
        """Return the state at the end of the increment."""
        moved, contact = self.relative_displacement(now, solution.force), replace(solution, bases=now.contact.bases)
        reached = advanced(self.start, contact, moved, self._until_touch, self.move)
        return replace(reached, body=DeformedBody(now.x, previous=(self.move, self.start.body.unknowns)))
