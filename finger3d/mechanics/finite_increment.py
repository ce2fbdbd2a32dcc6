"""One increment of contact at finite strain: Newton's method for equilibrium around the contact solution.

At displacements u with internal forces R(u), tangent K, contact rows B(u) and contact forces f, the next forces f' and
displacements u' solve ::

    u' = u + K^-1 (B^T f' - R),    contact conditions of f' and of the gaps and slips at u, moved by B (u' - u)

The forces are total, not increments, so that f = 0 in an open point.  Iterations reuse the factor of an earlier
tangent, also one of an earlier increment or press, while they converge (chord method, Ortega and Rheinboldt 1970, sec.
7.1): the residual is that of the present configuration, so that the solution does not depend on it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, augmentation_parameters, residual
from finger3d.contact.state import ContactSolution, ContactState, next_state
from finger3d.errors import Outcome
from finger3d.fem.assembly import on_places
from finger3d.fem.condense import Condensation, condense
from finger3d.fem.finite_contact import DeformedContact, deformed_contact
from finger3d.fem.hyperelastic import InvertedError
from finger3d.fem.laws.stability import least_stiffness, unstable_from
from finger3d.fem.recover import displacement
from finger3d.fem.traces import BoundarySurface
from finger3d.mechanics.finite_body import FiniteBody
from finger3d.mechanics.formulation import Workspace, length_scale, solve_contact
from finger3d.mechanics.linear_contact import carried_by_object, transported
from finger3d.mechanics.path import stride_ratio
from finger3d.mechanics.problem import Problem, scatter_to_points
from finger3d.mechanics.relaxation import InternalVariables
from finger3d.objects import ObjectPose, vertical_frame

_ITERATIONS, _FACTORS = 60, 15
"""Largest number of iterations and of new factors in an increment."""

_TARGET_RESIDUAL = 1e-9
"""Residual at which the iteration ends; where round-off prevents it, one up to `TOLERANCE` that no longer falls."""

_SLOW = 0.35
"""Ratio of successive residuals above which the tangent is factored again; a factor costs about five iterations."""

_LARGEST_STEP = 10.0
"""Displacement of one iteration, in depths of the press, beyond which it diverges."""

_STEP_LENGTHS = (1.0, 0.5, 0.25, 0.125)
"""Fractions of a step tried in the line search, until no cell is inverted."""


@dataclass(frozen=True, kw_only=True)
class DeformedState(ContactState):
    """Contact state of a body at finite strain.

    Attributes
    ----------
    unknowns : (N,) of the meshed part
    memory : internal variables of a body that relaxes
    previous : pose and unknowns at the start of the increment that led here
    """

    unknowns: Float
    memory: InternalVariables | None = None
    previous: tuple[ObjectPose, Float] | None = None


@dataclass(frozen=True)
class Linearisation:
    """Body linearised at one configuration: the factored tangent and the compliance of the contact points.

    Attributes
    ----------
    condensation : of the tangent, to the contact rows
    bases : (c, d, d) directions of the contact points
    delassus : (c, d, c, d) mm/N, in these directions
    """

    condensation: Condensation
    bases: Float
    delassus: Float

    def delassus_active(self, bases: Float) -> Float:
        """Return the Delassus operator (c, d, c, d) in other directions (c, d, d)."""
        turn = bases @ np.swapaxes(self.bases, 1, 2)
        return rotated(self.delassus, turn)


@dataclass
class FiniteStrainWorkspace(Workspace):
    """Discretisation and last linearisation of a body, with which its next increment begins.

    Both have two entries: of the body with its inclusions (True) and without.
    """

    bodies: dict[bool, FiniteBody] = field(default_factory=dict)
    linearisations: dict[bool, Linearisation] = field(default_factory=dict)


@dataclass(frozen=True)
class _Configuration:
    """Unknowns x (N,), internal forces (N,) and contact of the deformed surface there."""

    x: Float
    internal: Float
    contact: DeformedContact


def rotated(delassus: Float, turn: Float) -> Float:
    """Return a Delassus operator (c, d, c, d) in directions turned point by point by (c, d, d)."""
    c, d = turn.shape[:2]
    half = (turn @ delassus.reshape(c, d, c * d)).reshape(c * d, c, d)
    return np.asarray((half.transpose(1, 0, 2) @ turn.transpose(0, 2, 1)).transpose(1, 0, 2).reshape(c, d, c, d))


def contact_of(problem: Problem, face: BoundarySurface, u: Float, target: ObjectPose) -> DeformedContact:
    """Return the contact of a face displaced by u (n, d) with the object in a pose."""
    gap, normal = problem.placed(target).distance(face.samples + face.interpolate @ u)
    return deformed_contact(
        face,
        points=problem.mesh.points,
        displacement=u,
        gap=gap,
        normal=normal,
        axes=problem.axes,
        share=problem.system.object_share if face is problem.surface else None,
    )


@dataclass(frozen=True)
class FiniteIncrement:
    """An increment from a state, as the object moves from pose a to pose b."""

    problem: Problem
    body: FiniteBody
    start: DeformedState
    a: ObjectPose
    b: ObjectPose
    workspace: FiniteStrainWorkspace

    def solve(self, guess: Float | None) -> ContactSolution:
        """Iterate until equilibrium and the contact conditions hold; the state is without internal variables."""
        force = self.start.force if guess is None else guess
        now = self._first_configuration()
        linearisation, factors = self.workspace.linearisations.get(self._has_inclusions), 0
        outcome, spent = Outcome.NEWTON, 0
        error, size = math.inf, math.inf
        for _ in range(_ITERATIONS):
            if linearisation is None:
                if factors == _FACTORS:
                    break
                linearisation, factors = self._linearise(now, force), factors + 1
            solution, step = self._step(now, force, linearisation)
            spent += solution.iterations
            if not solution.outcome.ok:
                if not factors:
                    linearisation = None
                    continue
                return replace(solution, state=self.start, iterations=spent)
            last_size, size = size, float(np.abs(step[: self.problem.mesh.points.size]).max()) / self._length_scale
            if not size < max(_LARGEST_STEP, 1e3 * last_size):  # NaN too
                break
            try:
                now = self._moved(now, step)
            except InvertedError:
                outcome = Outcome.INVERTED
                break
            force = solution.state.force
            last_error, error = error, self._residual(now, solution.state)
            if error <= _TARGET_RESIDUAL or 0.3 * last_error < error <= TOLERANCE:
                if self._instability(now):
                    break
                state = self._state(now, solution.state)
                return replace(solution, state=state, residual=max(solution.residual, error), iterations=spent)
            if error > _SLOW * last_error:
                linearisation = None
        detail = self._instability(now)
        return ContactSolution(self.start, Outcome.UNSTABLE if detail else outcome, error, spent, "none", detail)

    @property
    def _has_inclusions(self) -> bool:
        return self.body.bars is not None

    @cached_property
    def _length_scale(self) -> float:
        return length_scale(self.problem, self.a, self.b)

    @cached_property
    def _augmentation(self) -> Float:
        delassus = self.problem.delassus
        c, d = delassus.shape[:2]
        return augmentation_parameters(delassus.reshape(c * d, c * d), d)

    def _first_configuration(self) -> _Configuration:
        """Return the configuration extrapolated from the increment before, or that of the first state."""
        for x in self._extrapolated():
            try:
                return self._at(x)
            except InvertedError:
                continue
        return self._at(self.start.unknowns)

    def _extrapolated(self) -> Iterator[Float]:
        if self.start.previous is not None:
            pose, x = self.start.previous
            ratio = stride_ratio(pose, self.a, self.b)
            if ratio is not None:
                yield self.start.unknowns + ratio * (self.start.unknowns - x)

    def _at(self, x: Float) -> _Configuration:
        problem = self.problem
        contact = contact_of(problem, problem.surface, displacement(problem.mesh, x), self.b)
        return _Configuration(x, self.body.internal_forces(x), contact)

    def _moved(self, now: _Configuration, step: Float) -> _Configuration:
        """Return the configuration after the longest fraction of a step that inverts no cell.

        Raises
        ------
        InvertedError
            If even the shortest fraction inverts a cell.
        """
        for length in _STEP_LENGTHS:
            try:
                return self._at(now.x + length * step)
            except InvertedError:
                continue
        raise InvertedError

    def _linearise(self, now: _Configuration, force: Float) -> Linearisation:
        """Factor the tangent under contact forces (c, d), and leave it to later increments."""
        problem, pattern = self.problem, self.body.contact_rows
        active = problem.system.active_dofs
        entries = on_places(now.contact.rows[active], pattern)
        rows = sp.csr_matrix((entries, pattern.indices, pattern.indptr), pattern.shape)
        tangent = self.body.tangent(now.x).less(now.contact.geometric_stiffness(problem.surface, force[:, 0]))
        last = self.workspace.linearisations.pop(self._has_inclusions, None)
        replaced = last.condensation if last else None
        condensed = condense(tangent, problem.part.fixed_dofs, rows, replaced=replaced)
        self.workspace.factorizations += condensed.factorizations
        delassus = scatter_to_points(condensed.compliance, active, *force.shape)
        found = self.workspace.linearisations[self._has_inclusions] = Linearisation(
            condensed, now.contact.bases, delassus
        )
        return found

    def _step(self, now: _Configuration, force: Float, linearisation: Linearisation) -> tuple[ContactSolution, Float]:
        """Solve contact of the linearised body; returns the solution and the step (N,) of the unknowns."""
        problem, start = self.problem, transported(self.start, now.contact.bases)
        settled = linearisation.condensation.solve(-self._out_of_balance(now, force))
        delassus = linearisation.delassus_active(now.contact.bases)
        compliance = self._object_compliance
        if compliance is not None:
            delassus = delassus + rotated(compliance, now.contact.bases @ vertical_frame(problem.dim).T)
        free = self._relative_displacement(now, force)
        free += self._active(now.contact.rows @ settled[: problem.mesh.points.size])
        free -= (delassus.reshape(force.size, force.size) @ force.ravel()).reshape(force.shape)
        free[:, 1:] += start.tangential_displacement
        solution = solve_contact(problem, start, free, delassus, self._length_scale, force, self._augmentation)
        change = self._active((solution.state.force - force).ravel()).ravel()
        load = np.zeros_like(settled)
        load[: problem.mesh.points.size] = now.contact.rows.T @ change
        return solution, settled + linearisation.condensation.solve(load)

    def _out_of_balance(self, now: _Configuration, force: Float) -> Float:
        """Internal less contact forces (N,)."""
        out = now.internal.copy()
        out[: self.problem.mesh.points.size] -= now.contact.rows.T @ self._active(force.ravel()).ravel()
        return out

    def _active(self, vector: Float) -> Float:
        """Return a vector (c d,) as (c, d), zero across symmetry planes.

        The weighted mean over half of a point's hat need not be zero there.
        """
        out = np.zeros(len(vector))
        out[self.problem.system.active_dofs] = vector[self.problem.system.active_dofs]
        return out.reshape(-1, self.problem.dim)

    @cached_property
    def _object_compliance(self) -> Float | None:
        return self.problem.system.object_compliance

    def _relative_displacement(self, now: _Configuration, force: Float) -> Float:
        """Gap and increment of tangential displacement (c, d) under forces (c, d), in the present directions."""
        problem, bases = self.problem, now.contact.bases
        at, before = (problem.surface.trace @ displacement(problem.mesh, x) for x in (now.x, self.start.unknowns))
        increment = at - before - carried_by_object(problem, self.a, self.b, at)
        out = np.empty_like(force)
        out[:, 0] = now.contact.gap
        compliance = self._object_compliance
        if compliance is not None:
            frame = vertical_frame(problem.dim)
            assert self.start.bases is not None
            upright, earlier = (
                np.einsum("ca,cak->ck", f, b) @ frame.T
                for f, b in ((force, bases), (self.start.force, self.start.bases))
            )
            matrix = compliance.reshape(force.size, force.size)
            whole, last = ((matrix @ f.ravel()).reshape(force.shape) @ frame for f in (upright, earlier))
            out[:, 0] += np.einsum("ck,ck->c", bases[:, 0], whole)
            increment = increment + whole - last
        out[:, 1:] = np.einsum("ctk,ck->ct", bases[:, 1:], increment)
        return self._active(out.ravel())

    def _residual(self, now: _Configuration, solution: ContactState) -> float:
        """Largest violation of contact conditions, equilibrium and p = K (J - 1), dimensionless.

        Lengths are divided by the depth, forces by the largest nodal force, p by the shear modulus.  The friction
        coefficients are those that the contact solution has used.
        """
        problem, force = self.problem, solution.force
        mesh, n = problem.mesh, problem.mesh.points.size
        normal, tangential = force[:, 0], np.linalg.norm(force[:, 1:], axis=1)
        mu = tangential / np.where(normal > 0.0, normal, 1.0)
        unbalanced = self._out_of_balance(now, force)
        unbalanced[problem.part.fixed_dofs] = 0.0
        largest = np.linalg.norm(force, axis=1).max() or np.abs(now.internal[:n]).max() or 1.0
        equilibrium = float(np.abs(unbalanced[:n]).max() / largest)
        volume = float(np.abs(np.linalg.det(np.diff(mesh.points[mesh.cells[:, : mesh.dim + 1]], axis=1))).mean())
        volume *= problem.part.thickness / math.factorial(mesh.dim) * self.body.solid.pressure_scale
        dilatation = float(np.abs(unbalanced[n:]).max(initial=0.0)) / volume
        moved = self._relative_displacement(now, force)
        return max(residual(force, moved, solution.status, mu, self._length_scale), equilibrium, dilatation)

    def _instability(self, now: _Configuration) -> str:
        """Return where the material law is unstable, in words; empty if it is stable."""
        law = self.body.solid.material.law
        if law.is_stable:
            return ""
        f = self.body.solid.deformation(now.x, self.body.relaxing)
        stretches = np.sqrt(np.linalg.eigvalsh(np.swapaxes(f, 1, 2) @ f))
        stiffness = least_stiffness(law, stretches)
        if (stiffness > 0.0).all():
            return ""
        reached = ", ".join(f"{stretch:.3g}" for stretch in stretches[stiffness.argmin()])
        limits = (f"{strain:.3g} in {mode}" for mode, strain in unstable_from(law).items())
        return f"principal stretches reach {reached}; the stress falls from nominal strains of {', '.join(limits)}"

    def _state(self, now: _Configuration, solution: ContactState) -> DeformedState:
        """Return the state at the end of the increment."""
        moved = self._relative_displacement(now, solution.force)
        start = transported(self.start, now.contact.bases)
        after = next_state(start, solution.force, moved, solution.status)
        return DeformedState(
            **(vars(after) | {"bases": now.contact.bases}), unknowns=now.x, previous=(self.a, self.start.unknowns)
        )
