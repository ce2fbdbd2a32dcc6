"""Finite strain: a neo-Hookean body, and contact conditions on its deformed surface.

Newton's method around the contact solution.  At displacements u with internal forces R(u), tangent K and normals and
tangents B of the contact points, the contact forces f and the next displacements solve ::

    u' = u + K^-1 (B^T f - R),    contact conditions of f and B u'

The forces are total, not increments, so f = 0 in an open point.  `u - K^-1 R` is the free motion of the increment.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, augmentation_parameters, residual
from finger3d.contact.state import ContactSolution, ContactState, next_state
from finger3d.effects.base import fill
from finger3d.errors import Outcome
from finger3d.fem.assembly import Pattern, Stiffness, on_places, pressure_scale
from finger3d.fem.condense import Condensation, condense
from finger3d.fem.finite_contact import DeformedContact, deformed_contact
from finger3d.fem.neo_hooke import InvertedError, NeoHooke, assemble, nodal_fields
from finger3d.fem.recover import displacement
from finger3d.fem.traces import BoundarySurface
from finger3d.mechanics.cost import FACTORISATIONS, AddedCost, PressCost
from finger3d.mechanics.formulation import Workspace, length_scale, moment_of, solve_contact
from finger3d.mechanics.linear_contact import carried_by_object
from finger3d.mechanics.model import Model
from finger3d.mechanics.problem import Problem, scatter_to_points
from finger3d.objects import ObjectPose

_ITERATIONS = 19
"""Newton iterations of an increment, at most."""

_TARGET_RESIDUAL = 1e-9
"""Residual at which the iteration ends; where round-off prevents it, one up to `TOLERANCE` that no longer falls."""

_LARGEST_STEP = 10.0
"""Displacement of one Newton step, in depths of the press, beyond which the iteration diverges."""

_STEP_LENGTHS = (1.0, 0.5, 0.25, 0.125)
"""Fractions of a Newton step tried in the line search, until no cell is inverted."""

_NUMERIC_FACTORISATION = 0.8
"""Time of a factorisation whose ordering is known, over that of a condensation."""

_TANGENT_ASSEMBLY = 0.8
"""Time to assemble the tangent over that of the linear stiffness."""

_OTHER_S = {2: 0.008, 3: 0.12}
"""Further seconds of an increment, by dimension."""


@dataclass(frozen=True, kw_only=True)
class DeformedState(ContactState):
    """Contact state with the unknowns (N,) of the meshed part."""

    unknowns: Float


@dataclass(frozen=True)
class _Configuration:
    """Unknowns x (N,), and internal forces (N,) and tangent there; None for a tangent that was factored before."""

    x: Float
    internal: Float
    tangent: Stiffness | None


@dataclass
class NewtonWorkspace(Workspace):
    """Sparsity patterns of the tangent, and the configuration where the last increment ended with its condensation.

    The condensation serves the next increment if it begins there; otherwise its factor is overwritten.
    """

    end: _Configuration | None = None
    condensation: Condensation | None = None
    _patterns: tuple[Pattern, sp.csr_matrix] | None = None

    def patterns(self, problem: Problem) -> tuple[Pattern, sp.csr_matrix]:
        """Sparsity patterns of the tangent and of the contact rows (r, n d), the same in all iterations."""
        if self._patterns is None:
            face, d = problem.surface, problem.dim
            coupled = sp.csr_matrix((face.average != 0).astype(float) @ (face.interpolate != 0).astype(float))
            pairs = (coupled.T @ coupled).tocoo()
            rows = sp.kron(coupled, np.ones((d, d)), format="csr")[problem.system.active_dofs]
            rows.sort_indices()
            linked = pairs.row.astype(np.int64), pairs.col.astype(np.int64)
            self._patterns = Pattern.of(problem.mesh, problem.part.elastic.mixed, linked), rows
        return self._patterns


@dataclass(frozen=True)
class FiniteStrain:
    """Kinematics of a neo-Hookean body."""

    finite_strain: ClassVar[bool] = True
    is_linear_elastic: ClassVar[bool] = False
    refactorises: ClassVar[bool] = True
    supported_slots: ClassVar[frozenset[str]] = frozenset()

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return the cost of the factorisations in every increment."""
        increment = FACTORISATIONS * _NUMERIC_FACTORISATION * press.seconds["condensation"]
        increment += (FACTORISATIONS + 1) * _TANGENT_ASSEMBLY * press.seconds["assembly"] + _OTHER_S[press.dim]
        return AddedCost(
            seconds=press.increments * increment + (FACTORISATIONS - 1) * press.seconds["contact"],
            memory_mb=press.factor_mb,
            reason=f"about {FACTORISATIONS} factorisations in each of {press.increments} steps",
        )

    def state_size(self, press: PressCost) -> float:
        """Return the number of unknowns."""
        return press.dofs

    def workspace(self) -> NewtonWorkspace:
        """Return a workspace without patterns and factors."""
        return NewtonWorkspace()

    def start(self, problem: Problem) -> DeformedState:
        """State at rest."""
        mesh = problem.mesh
        unknowns = np.zeros(mesh.points.size + (len(mesh.vertices) if _law(problem).mixed else 0))
        bases = np.broadcast_to(problem.points.basis, (len(problem.surface.nodes), problem.dim, problem.dim))
        rest = ContactState.at_rest(problem.gap(problem.origin), problem.dim)
        return DeformedState(**(vars(rest) | {"bases": bases}), unknowns=unknowns)

    def increment(
        self,
        problem: Problem,
        state: ContactState,
        a: ObjectPose,
        b: ObjectPose,
        guess: Float | None,
        workspace: Workspace,
    ) -> ContactSolution:
        """Iterate until equilibrium and contact conditions hold in the deformed configuration."""
        assert isinstance(state, DeformedState)
        assert isinstance(workspace, NewtonWorkspace)
        newton = _NewtonIncrement(problem, state, a, b, workspace)
        configuration, condensation = newton.begin()
        contact = newton.contact(configuration)
        force = state.force if guess is None else guess
        outcome, iterations = Outcome.NEWTON, 0
        error = size = math.inf
        for _ in range(_ITERATIONS):
            condensation = newton.linearise(configuration, contact, force, condensation)
            solution, step = newton.solve_contact(configuration, contact, force, condensation)
            iterations += solution.iterations
            if not solution.outcome.ok:
                return replace(solution, state=state, iterations=iterations)
            force = solution.state.force
            last_size, size = size, newton.step_size(step)
            if not size < max(_LARGEST_STEP, 1e3 * last_size):  # NaN too
                break
            try:
                configuration = newton.line_search(configuration, step)
            except InvertedError:
                outcome = Outcome.INVERTED
                break
            contact = newton.contact(configuration)
            last_error, error = error, newton.residual(configuration, contact, solution.state)
            if error <= _TARGET_RESIDUAL or 0.3 * last_error < error <= TOLERANCE:
                newton.keep(configuration, condensation)
                converged = newton.state(configuration, contact, solution.state)
                return replace(solution, state=converged, residual=max(solution.residual, error), iterations=iterations)
        return ContactSolution(state, outcome, error, iterations, "none")

    def unknowns(self, problem: Problem, state: ContactState) -> Float:
        """All unknowns (N,), which the state holds."""
        assert isinstance(state, DeformedState)
        return state.unknowns

    def all_unknowns(self, problem: Problem, states: Sequence[ContactState]) -> Iterator[Float]:
        """All unknowns (N,) of each state."""
        return (self.unknowns(problem, state) for state in states)

    def gauges(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Relative elongation of a line along the gauge, at its point or between its ends."""
        mesh, axes = problem.mesh, problem.axes
        u = displacement(mesh, self.unknowns(problem, state))
        return {gauge.name: gauge.finite_strain(mesh, u, axes) for gauge in problem.model.gauges}

    def moment(self, problem: Problem, state: ContactState, target: ObjectPose) -> Float:
        """Return the moment about the middle of the base, of nodal forces at the displaced nodes."""
        mesh = problem.mesh
        u = displacement(mesh, self.unknowns(problem, state))
        contact = _contact(problem, problem.surface, u, target)
        nodal = (contact.rows.T @ state.force.ravel()).reshape(u.shape)
        return moment_of(mesh.points + u, nodal)

    def gap(self, problem: Problem, u: Float, target: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Return gaps and normals in the deformed configuration."""
        contact = _contact(problem, surface, u, target)
        return contact.gap, contact.bases[:, 0]

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Displacement, Green-Lagrange strain and Cauchy stress."""
        unknowns = self.unknowns(problem, state)
        strain, cauchy = nodal_fields(problem.mesh, _law(problem), unknowns)
        return displacement(problem.mesh, unknowns), strain, cauchy


def _law(problem: Problem) -> NeoHooke:
    material = problem.model.material.isotropic("effects.large_deformation")
    return NeoHooke.of(material.E_MPa, material.nu, problem.model.domain == "plane-stress")


@dataclass(frozen=True)
class _NewtonIncrement:
    """Stages of the Newton iteration from a state, as the object moves from pose a to pose b."""

    problem: Problem
    start: DeformedState
    a: ObjectPose
    b: ObjectPose
    workspace: NewtonWorkspace

    @cached_property
    def _law(self) -> NeoHooke:
        return _law(self.problem)

    @cached_property
    def _length_scale(self) -> float:
        return length_scale(self.problem, self.a, self.b)

    @cached_property
    def _augmentation(self) -> Float:
        delassus = self.problem.delassus
        c, d = delassus.shape[:2]
        return augmentation_parameters(delassus.reshape(c * d, c * d), d)

    def begin(self) -> tuple[_Configuration, Condensation | None]:
        """Return the configuration of the first state, and the condensation that the last increment left."""
        end, condensation = self.workspace.end, self.workspace.condensation
        self.workspace.end = self.workspace.condensation = None
        if end is not None and end.x is self.start.unknowns:
            return end, condensation
        return self._configuration(self.start.unknowns), condensation

    def keep(self, configuration: _Configuration, condensation: Condensation) -> None:
        """Leave the last configuration and condensation to the next increment."""
        self.workspace.end, self.workspace.condensation = replace(configuration, tangent=None), condensation

    def _configuration(self, x: Float) -> _Configuration:
        pattern, _ = self.workspace.patterns(self.problem)
        tangent, internal = assemble(self.problem.mesh, self._law, x, pattern, self.problem.part.thickness)
        return _Configuration(x, internal, tangent)

    def contact(self, configuration: _Configuration) -> DeformedContact:
        """Gaps, directions and contact rows of the deformed surface under the object at b."""
        problem = self.problem
        return _contact(problem, problem.surface, displacement(problem.mesh, configuration.x), self.b)

    def linearise(
        self,
        configuration: _Configuration,
        contact: DeformedContact,
        force: Float,
        condensation: Condensation | None,
    ) -> Condensation:
        """Condense the tangent under contact forces (c, d); a tangent of None has been condensed before."""
        if configuration.tangent is None:
            assert condensation is not None
            return condensation
        problem = self.problem
        _, pattern = self.workspace.patterns(problem)
        entries = on_places(contact.rows[problem.system.active_dofs], pattern)
        rows = sp.csr_matrix((entries, pattern.indices, pattern.indptr), pattern.shape)
        tangent = configuration.tangent.less(contact.geometric_stiffness(problem.surface, force[:, 0]))
        condensed = condense(tangent, problem.part.fixed_dofs, rows, replaced=condensation)
        self.workspace.factorizations += condensed.factorizations
        return condensed

    def solve_contact(
        self, configuration: _Configuration, contact: DeformedContact, guess: Float, condensation: Condensation
    ) -> tuple[ContactSolution, Float]:
        """Solve contact of the linearised body; returns the solution and the Newton step (N,) of the unknowns."""
        problem, start = self.problem, self.start
        c, d = start.force.shape
        relaxation = condensation.solve(-configuration.internal)
        free = self._relative_displacement(contact, configuration, relaxation)
        free[:, 0] += (contact.rows @ relaxation[: problem.mesh.points.size])[::d]
        free[:, 1:] += start.tangential_displacement
        delassus = scatter_to_points(condensation.compliance, problem.system.active_dofs, c, d)
        solution = solve_contact(problem, start, free, delassus, self._length_scale, guess, self._augmentation)
        forces = solution.state.force.ravel()[problem.system.active_dofs]
        return solution, relaxation + condensation.unknowns(forces)

    def _relative_displacement(
        self, contact: DeformedContact, configuration: _Configuration, step: Float | None = None
    ) -> Float:
        """Gap and increment of tangential displacement (c, d) in a configuration, in the directions of `contact`.

        The displacement may be that after a further step (N,), with the object's material where it is without.
        """
        problem = self.problem
        n, d = problem.mesh.points.size, problem.dim
        at, before = (problem.surface.trace @ x[:n].reshape(-1, d) for x in (configuration.x, self.start.unknowns))
        increment = at - before - carried_by_object(problem, self.a, self.b, at)
        if step is not None:
            increment = increment + problem.surface.trace @ step[:n].reshape(-1, d)
        out = np.empty((len(contact.gap), d))
        out[:, 0] = contact.gap
        out[:, 1:] = np.einsum("ctk,ck->ct", contact.bases[:, 1:], increment)
        # Across a symmetry plane nothing moves; the weighted mean over half of a point's hat need not be zero.
        out.ravel()[np.setdiff1d(np.arange(out.size), problem.system.active_dofs)] = 0.0
        return out

    def step_size(self, step: Float) -> float:
        """Largest displacement of a step, in depths of the press; NaN if the step is not finite."""
        return float(np.abs(step[: self.problem.mesh.points.size]).max()) / self._length_scale

    def line_search(self, configuration: _Configuration, step: Float) -> _Configuration:
        """Return the configuration after the longest fraction of a step that inverts no cell.

        Raises
        ------
        InvertedError
            If even the shortest fraction inverts a cell.
        """
        for length in _STEP_LENGTHS:
            try:
                return self._configuration(configuration.x + length * step)
            except InvertedError:
                continue
        raise InvertedError

    def residual(self, configuration: _Configuration, contact: DeformedContact, solution: ContactState) -> float:
        """Largest violation of contact conditions, equilibrium and p = K (J - 1), dimensionless.

        Lengths are divided by the depth, forces by the largest nodal force, p by the shear modulus.  The friction
        coefficients are those that the contact solution has used.
        """
        problem, force = self.problem, solution.force
        mesh, n = problem.mesh, problem.mesh.points.size
        normal, tangential = force[:, 0], np.linalg.norm(force[:, 1:], axis=1)
        mu = tangential / np.where(normal > 0.0, normal, 1.0)
        out_of_balance = configuration.internal.copy()
        out_of_balance[:n] -= contact.rows[problem.system.active_dofs].T @ force.ravel()[problem.system.active_dofs]
        out_of_balance[problem.part.fixed_dofs] = 0.0
        largest = np.linalg.norm(force, axis=1).max() or np.abs(configuration.internal[:n]).max() or 1.0
        equilibrium = float(np.abs(out_of_balance[:n]).max() / largest)
        volume = float(np.abs(np.linalg.det(np.diff(mesh.points[mesh.cells[:, : mesh.dim + 1]], axis=1))).mean())
        volume *= problem.part.thickness / math.factorial(mesh.dim) * pressure_scale(mesh, self._law.shear)
        dilatation = float(np.abs(out_of_balance[n:]).max(initial=0.0)) / volume
        moved = self._relative_displacement(contact, configuration)
        return max(residual(force, moved, solution.status, mu, self._length_scale), equilibrium, dilatation)

    def state(self, configuration: _Configuration, contact: DeformedContact, solution: ContactState) -> DeformedState:
        """Return the state at the end of the increment."""
        moved = self._relative_displacement(contact, configuration)
        after = next_state(self.start, solution.force, moved, solution.status)
        return DeformedState(**(vars(after) | {"bases": contact.bases}), unknowns=configuration.x)


def _contact(problem: Problem, face: BoundarySurface, u: Float, target: ObjectPose) -> DeformedContact:
    """Contact of a face displaced by u (n, d) with the object at a pose; gaps are means over the deformed area."""
    placed = problem.placed(target)
    position = face.samples + face.interpolate @ u
    gap, normal = placed.distance(position)
    return deformed_contact(
        face,
        points=problem.mesh.points,
        displacement=u,
        gap=gap,
        normal=normal,
        axes=problem.axes,
    )


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.large_deformation]: none. Neo-Hookean, W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2."""

    slot: ClassVar[str] = "formulation"

    def apply(self, model: Model) -> Model:
        """Set the formulation of the model."""
        model.material.isotropic("effects.large_deformation")
        return fill(model, "formulation", FiniteStrain(), "large_deformation")
