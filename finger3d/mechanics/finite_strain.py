"""Finite strain: a hyperelastic body, and contact conditions on its deformed surface."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.elements import quadrature
from finger3d.fem.hyperelastic import Hyperelastic, nodal_fields
from finger3d.fem.laws import IsochoricLaw
from finger3d.fem.recover import displacement, extrapolated
from finger3d.fem.tensors import determinant
from finger3d.fem.traces import BoundarySurface
from finger3d.mechanics.cost import AddedCost, PressCost, finite_strain_s
from finger3d.mechanics.finite_body import FiniteBody
from finger3d.mechanics.finite_increment import FiniteIncrement
from finger3d.mechanics.finite_state import DeformedState, FiniteStrainWorkspace, contact_of
from finger3d.mechanics.finite_together import solve_together
from finger3d.mechanics.formulation import Workspace, moment_of
from finger3d.mechanics.linear_contact import carried_by_object
from finger3d.mechanics.passing import moves_too_far, passes_through, pulls
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.relaxation import InternalVariables, Relaxation, Step, relaxed
from finger3d.objects import ObjectPose

if TYPE_CHECKING:
    from finger3d.mechanics.model import Model


@dataclass(frozen=True)
class FiniteStrain:
    """Finite strain of a hyperelastic body.

    Attributes
    ----------
    law : isochoric part of the energy, with the shear modulus of the model's material in place of its own
    relaxation : of the stresses (Simo 1987), if any
    """

    finite_strain: ClassVar[bool] = True
    is_linear_elastic: ClassVar[bool] = False
    refactorises: ClassVar[bool] = True

    law: IsochoricLaw
    relaxation: Relaxation | None = None

    def relaxing(self, relaxation: Relaxation) -> FiniteStrain:
        """Return the formulation with stresses that relax."""
        return replace(self, relaxation=relaxation)

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return the cost of the factorisations in every increment."""
        increment = finite_strain_s(press.dofs, press.seconds["condensation"])
        return AddedCost(
            seconds=press.increments * increment,
            memory_mb=press.factor_mb,
            reason=f"about one factorisation and nine iterations in each of {press.increments} steps",
        )

    def state_size(self, press: PressCost) -> float:
        """Return the number of unknowns, and of internal variables: 9 at 4 points of each of some dofs / 4.5 cells."""
        branches = len(self.relaxation.prony) + 1 if self.relaxation else 0
        return press.dofs * (1.0 + 8.0 * branches)

    def workspace(self) -> FiniteStrainWorkspace:
        """Return a workspace without body and factor."""
        return FiniteStrainWorkspace()

    def _body(self, problem: Problem, workspace: FiniteStrainWorkspace | None = None) -> FiniteBody:
        has_inclusions = problem.inclusions.bars is not None
        if workspace is not None and has_inclusions in workspace.bodies:
            return workspace.bodies[has_inclusions]
        body = FiniteBody.of(problem, self._material(problem))
        if workspace is not None:
            workspace.bodies[has_inclusions] = body
        return body

    def _material(self, problem: Problem) -> Hyperelastic:
        mesh, plane_stress = problem.mesh, problem.model.domain == "plane-stress"
        found = problem.model.materials(mesh.part_labels)
        linear = [material.isotropic("effects.large_deformation") for material in found]
        if mesh.part is None:
            law = self.law.with_shear(linear[0].E_MPa / (2.0 * (1.0 + linear[0].nu)))
            return Hyperelastic.of(law, linear[0].nu, plane_stress)
        points = len(quadrature(mesh.dim, 2)[0])
        return Hyperelastic.of_parts(self.law, linear, np.repeat(mesh.part, points), plane_stress)

    def start(self, problem: Problem) -> DeformedState:
        """State at rest."""
        mesh, body = problem.mesh, self._body(problem)
        x = np.zeros(mesh.points.size + len(body.solid.pattern.vertices))
        contact = contact_of(problem, problem.surface, displacement(mesh, x), problem.origin)
        memory = None
        if self.relaxation is not None:
            size = len(body.relaxing_variables(x, self.relaxation.bulk))
            memory = InternalVariables.at_rest(self.relaxation.prony, size)
        rest = ContactState.at_rest(contact.gap, problem.dim)
        return DeformedState(**(vars(rest) | {"bases": contact.bases}), unknowns=x, memory=memory)

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
        known, workspace.known = workspace.known, None
        u = displacement(problem.mesh, self.unknowns(problem, state))
        before = problem.surface.trace @ u
        if moves_too_far(problem, a, b, state.gap, carried_by_object(problem, a, b, before)):
            return ContactSolution(state, Outcome.PASSED_THROUGH, np.inf, 0, "none")
        found = known
        if found is None:
            increment = self._increment(problem, state, a, b, workspace)
            found = self._remembered(increment, increment.solve(guess))
        if not found.outcome.ok:
            return found
        after = problem.surface.trace @ displacement(problem.mesh, self.unknowns(problem, found.state))
        through = passes_through(problem, a, b, before, after, state.gap)
        if through or pulls(problem, state, found.state, a, b):
            return replace(found, state=state, outcome=Outcome.PASSED_THROUGH)
        return found

    def increments(
        self,
        problems: Sequence[Problem],
        starts: Sequence[tuple[ContactState, Float | None]],
        a: ObjectPose,
        b: ObjectPose,
        workspace: Workspace,
        leader: int,
    ) -> list[ContactSolution | None]:
        """Advance several presses of one body at once, from their states and with their guesses of the forces.

        See `finger3d.mechanics.finite_together.solve_together`.
        """
        increments = [
            self._increment(problem, state, a, b, workspace)
            for problem, (state, _) in zip(problems, starts, strict=True)
        ]
        found = solve_together(increments, [guess for _, guess in starts], leader)
        pairs = zip(increments, found, strict=True)
        return [None if one is None else self._remembered(increment, one) for increment, one in pairs]

    def _increment(
        self,
        problem: Problem,
        state: ContactState,
        a: ObjectPose,
        b: ObjectPose,
        workspace: Workspace,
    ) -> FiniteIncrement:
        assert isinstance(state, DeformedState)
        assert isinstance(workspace, FiniteStrainWorkspace)
        body = self._body(problem, workspace)
        if self.relaxation is not None and state.memory is not None:
            body = body.over(self.relaxation, state.memory, b.time_s - a.time_s)
        return FiniteIncrement(problem, body, state, a, b, workspace)

    def _remembered(self, increment: FiniteIncrement, found: ContactSolution) -> ContactSolution:
        """Return a solution with the internal variables at the end of the increment."""
        start, after = increment.start, found.state
        if not found.outcome.ok or self.relaxation is None or start.memory is None:
            return found
        assert isinstance(after, DeformedState)
        strained = increment.body.relaxing_variables(after.unknowns, self.relaxation.bulk)
        seconds = increment.b.time_s - increment.a.time_s
        memory = Step(self.relaxation.prony, seconds).after(start.memory, strained)
        return replace(found, state=replace(after, memory=memory))

    def unknowns(self, problem: Problem, state: ContactState) -> Float:
        """All unknowns (N,), which the state holds."""
        assert isinstance(state, DeformedState)
        return state.unknowns

    def all_unknowns(self, problem: Problem, states: Sequence[ContactState]) -> Iterator[Float]:
        """All unknowns (N,) of each state."""
        return (self.unknowns(problem, state) for state in states)

    def readings(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Return the readings in the deformed configuration; foils read the strain of their bars."""
        assert isinstance(state, DeformedState)
        model, body = problem.model, problem.meshed_body
        u, forces = displacement(problem.mesh, state.unknowns), self._nodal_forces(problem, state)
        found = {
            name: float(number)
            for reading in model.readings
            for name, number in zip(
                reading.columns(problem.dim), reading.at_finite_strain(body, u, forces), strict=True
            )
        }
        bars = problem.inclusions.bars
        if bars is not None:
            yielded = state.memory.elastic[-len(bars.stiffness) :] if state.memory else bars.yielded(u)
            strains = problem.inclusions.gauge_weights @ bars.strain(u, yielded)
            found |= {gauge.name: float(strain) for gauge, strain in zip(model.gauges, strains, strict=True)}
        return found

    def _nodal_forces(self, problem: Problem, state: DeformedState) -> Float:
        """Return the internal nodal forces (n, d) of the present stress; only taxels read them."""
        if not problem.model.taxels:
            return np.zeros((0, problem.dim))
        body = self._body(problem)
        if self.relaxation is not None and state.memory is not None:
            body = body.over(self.relaxation, state.memory, 0.0)
        return body.internal_forces(state.unknowns)[: problem.mesh.points.size].reshape(-1, problem.dim)

    def work_on_body(
        self, problem: Problem, before: ContactState, after: ContactState, a: ObjectPose, b: ObjectPose
    ) -> float:
        """Return the sum of the mean nodal forces times the displacements of the nodes."""
        ends = []
        for state, target in ((before, a), (after, b)):
            u = displacement(problem.mesh, self.unknowns(problem, state))
            ends.append((u, contact_of(problem, problem.surface, u, target).nodal_forces(state.force)))
        (u, force), (u_after, force_after) = ends
        return float(np.sum(0.5 * (force + force_after) * (u_after - u)))

    def moment(self, problem: Problem, state: ContactState, target: ObjectPose) -> Float:
        """Return the moment about the middle of the base, of nodal forces at the displaced nodes."""
        mesh = problem.mesh
        u = displacement(mesh, self.unknowns(problem, state))
        contact = contact_of(problem, problem.surface, u, target)
        return moment_of(mesh.points + u, contact.nodal_forces(state.force))

    def gap(self, problem: Problem, u: Float, target: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Return gaps and normals in the deformed configuration."""
        contact = contact_of(problem, surface, u, target)
        return contact.gap, contact.bases[:, 0]

    def may_touch(self, surface: BoundarySurface, normal: Float) -> NDArray[np.bool_]:
        """Return True for every point: walls rotate with the deformation and may touch the object as well."""
        return np.ones(len(surface.nodes), dtype=np.bool_)

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Displacement, Green-Lagrange strain and Cauchy stress."""
        x, body = self.unknowns(problem, state), self._body(problem)
        f, strain, cauchy = nodal_fields(body.solid, x)
        assert isinstance(state, DeformedState)
        if self.relaxation is not None and state.memory is not None:
            lost = relaxed(self.relaxation.prony, state.memory) - state.memory.elastic
            nodal = extrapolated(problem.mesh, lost[: 9 * body.points].reshape(-1, 3, 3))
            cauchy = cauchy + f @ nodal @ np.swapaxes(f, 1, 2) / determinant(f)[:, None, None]
        return displacement(problem.mesh, x), strain, cauchy
