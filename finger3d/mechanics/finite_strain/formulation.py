"""Finite strain: a hyperelastic body, and contact conditions on its deformed surface."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from finger3d._types import Float
from finger3d.contact.acceleration import one_thread
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.laws import IsochoricLaw
from finger3d.fem.laws.relaxation import InternalVariables, Relaxation, Step, relaxed
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.recovery.recover import displacement, extrapolated
from finger3d.fem.solids.deformed import nodal_fields
from finger3d.fem.solids.hyperelastic import Hyperelastic
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.fem.tensors import determinant
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.finite_strain.body import FiniteBody
from finger3d.mechanics.finite_strain.equations import IncrementEquations
from finger3d.mechanics.finite_strain.increment import FiniteIncrement, IncrementToForces
from finger3d.mechanics.finite_strain.state import DeformedBody, FiniteStrainWorkspace, contact_of
from finger3d.mechanics.finite_strain.together import solve_together
from finger3d.mechanics.formulation import Loads
from finger3d.mechanics.generalised import GeneralisedForces, forces_on
from finger3d.mechanics.passing import moves_too_far, passes_through, pulls
from finger3d.mechanics.readings.columns import Column, of_kind
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.linear_contact import carried_by_object
from finger3d.objects import Move, ObjectPose


@dataclass(frozen=True)
class FiniteStrain:
    """Finite strain of a hyperelastic body.

    Attributes
    ----------
    law : isochoric part of the energy, with the shear modulus of the model's material in place of its own
    relaxation : of the stresses (Simo 1987), if any
    """

    law: IsochoricLaw
    relaxation: Relaxation | None = None

    def workspace(self) -> FiniteStrainWorkspace:
        """Return a workspace without body and factor."""
        return FiniteStrainWorkspace()

    def body(self, problem: Problem, workspace: FiniteStrainWorkspace | None = None) -> FiniteBody:
        has_inclusions = problem.inclusions.bars is not None
        if workspace is not None and has_inclusions in workspace.bodies:
            return workspace.bodies[has_inclusions]
        body = FiniteBody.of(problem, self._material(problem))
        if workspace is not None:
            workspace.bodies[has_inclusions] = body
        return body

    def _material(self, problem: Problem) -> Hyperelastic:
        mesh, plane_stress = problem.mesh, problem.model.domain == "plane-stress"
        materials = problem.model.materials(mesh.part_labels)
        if mesh.part is None:
            law = self.law.with_shear(materials[0].E_MPa / (2.0 * (1.0 + materials[0].nu)))
            return Hyperelastic.of(law, materials[0].nu, plane_stress)
        points = len(quadrature(mesh.dim, 2)[0])
        return Hyperelastic.of_parts(self.law, materials, np.repeat(mesh.part, points), plane_stress)

    def start(self, problem: Problem) -> State[DeformedBody]:
        """Return the state at rest."""
        mesh, body = problem.mesh, self.body(problem)
        x = np.zeros(mesh.points.size + len(body.solid.pattern.vertices))
        contact = contact_of(problem, problem.surface, displacement(mesh, x), problem.origin)
        memory = None
        if self.relaxation is not None:
            size = len(body.relaxing_variables(x, self.relaxation.bulk))
            memory = InternalVariables.at_rest(self.relaxation.prony, size)
        rest = replace(ContactState.at_rest(contact.gap, problem.dim), bases=contact.bases)
        return State(rest, DeformedBody(x, memory))

    def increment(
        self,
        problem: Problem,
        state: State[DeformedBody],
        move: Move,
        guess: Float | None,
        workspace: FiniteStrainWorkspace,
        wanted: GeneralisedForces | None = None,
    ) -> ContactSolution[State[DeformedBody]]:
        """Iterate until equilibrium and contact conditions hold in the deformed configuration."""
        if wanted is None and _moves_too_far(problem, state, move):
            return ContactSolution(state, Outcome.PASSED_THROUGH, np.inf, 0, "none")
        increment = self.equations(problem, state, move, workspace)
        if wanted is None:
            return self.accepted(increment, increment.solve(guess))
        before = forces_on(problem, self.loads(problem, state, move.start).forces, move.start)
        known = problem, increment.body, state, move, workspace
        # PARDISO's Schur complement of two fingers, which nothing couples, crashes on two threads
        with one_thread():
            found, solution = IncrementToForces(*known, wanted, before[list(wanted.numbers)]).followed(guess)
        if solution.outcome.ok and _moves_too_far(problem, state, found.move):
            return replace(solution, state=state, outcome=Outcome.PASSED_THROUGH)
        return self.accepted(replace(increment, move=found.move), solution)

    def equations(
        self,
        problem: Problem,
        state: State[DeformedBody],
        move: Move,
        workspace: FiniteStrainWorkspace,
    ) -> FiniteIncrement:
        """Return the equations of an increment from a state, with the relaxation of the body over its time."""
        body = self.body(problem, workspace)
        memory = state.body.memory
        if self.relaxation is not None and memory is not None:
            body = body.over(self.relaxation, memory, move.duration_s)
        return FiniteIncrement(problem, body, state, move, workspace)

    def accepted(
        self, increment: FiniteIncrement, solution: ContactSolution[State[DeformedBody]]
    ) -> ContactSolution[State[DeformedBody]]:
        """Return a solution with its internal variables, unless finger or object passed through the other."""
        return self._kept_outside(increment, self._remembered(increment, solution))

    def _kept_outside(
        self, increment: FiniteIncrement, solution: ContactSolution[State[DeformedBody]]
    ) -> ContactSolution[State[DeformedBody]]:
        """Return a solution, as not converged if the finger or the object passed through the other."""
        if not solution.outcome.ok:
            return solution
        problem, start, move = increment.problem, increment.start, increment.move
        before, after = (_moved_points(problem, state) for state in (start, solution.state))
        through = passes_through(problem, move, before, after, start.contact.gap)
        if through or pulls(problem, start.contact, solution.state.contact, move):
            return replace(solution, state=start, outcome=Outcome.PASSED_THROUGH)
        return solution

    def _remembered(
        self, increment: FiniteIncrement, solution: ContactSolution[State[DeformedBody]]
    ) -> ContactSolution[State[DeformedBody]]:
        """Return a solution with the internal variables at the end of the increment."""
        if not solution.outcome.ok:
            return solution
        return replace(solution, state=self.remembered(increment, solution.state))

    def remembered(self, increment: IncrementEquations, state: State[DeformedBody]) -> State[DeformedBody]:
        """Return a state at the end of an increment with its internal variables."""
        before = increment.start.body.memory
        if self.relaxation is None or before is None:
            return state
        strained = increment.body.relaxing_variables(state.body.unknowns, self.relaxation.bulk)
        memory = Step(self.relaxation.prony, increment.move.duration_s).after(before, strained)
        return replace(state, body=replace(state.body, memory=memory))

    def unknowns(self, problem: Problem, states: Sequence[State[DeformedBody]]) -> Iterator[Float]:
        """Yield all unknowns (N,) of each state."""
        return (state.body.unknowns for state in states)

    def readings(self, problem: Problem, state: State[DeformedBody]) -> dict[Column, float]:
        """Return the readings in the deformed configuration; foils read the strain of their bars."""
        model, body, memory = problem.model, problem.meshed_body, state.body.memory
        u, forces = displacement(problem.mesh, state.body.unknowns), self._nodal_forces(problem, state.body)
        values = {
            column: float(number)
            for reading in model.readings
            for column, number in zip(
                reading.columns(problem.dim), reading.at_finite_strain(body, u, forces), strict=True
            )
        }
        bars = problem.inclusions.bars
        if bars is not None:
            yielded = memory.elastic[-len(bars.stiffness) :] if memory else bars.yielded(u)
            strains = problem.inclusions.gauge_weights @ bars.strain(u, yielded)
            values |= zip(of_kind(model.columns, "gauge"), map(float, strains), strict=True)
        return values

    def _nodal_forces(self, problem: Problem, state: DeformedBody) -> Float:
        """Return the internal nodal forces (n, d) of the present stress; only taxels read them."""
        if not problem.model.taxels:
            return np.zeros((0, problem.dim))
        body = self.body(problem)
        if self.relaxation is not None and state.memory is not None:
            body = body.over(self.relaxation, state.memory, 0.0)
        return body.internal_forces(state.unknowns)[: problem.mesh.points.size].reshape(-1, problem.dim)

    def loads(self, problem: Problem, state: State[DeformedBody], pose: ObjectPose) -> Loads:
        """Return the nodal forces, at the displaced nodes."""
        u = displacement(problem.mesh, state.body.unknowns)
        contact = contact_of(problem, problem.surface, u, pose)
        return Loads(problem.mesh.points + u, u, contact.nodal_forces(state.contact.force))

    def gap(self, problem: Problem, u: Float, pose: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Return gaps and normals in the deformed configuration."""
        contact = contact_of(problem, surface, u, pose)
        return contact.gap, contact.bases[:, 0]

    def fields(self, problem: Problem, state: State[DeformedBody]) -> tuple[Float, Float, Float]:
        """Return displacement, Green-Lagrange strain and Cauchy stress."""
        x, memory, body = state.body.unknowns, state.body.memory, self.body(problem)
        f, strain, cauchy = nodal_fields(body.solid, x)
        if self.relaxation is not None and memory is not None:
            lost = relaxed(self.relaxation.prony, memory) - memory.elastic
            nodal = extrapolated(problem.mesh, lost[: 9 * body.points].reshape(-1, 3, 3))
            cauchy = cauchy + f @ nodal @ np.swapaxes(f, 1, 2) / determinant(f)[:, None, None]
        return displacement(problem.mesh, x), strain, cauchy


class Beginning(NamedTuple):
    """An increment of one of several presses that are solved at once: the press, its state, and where it goes.

    Attributes
    ----------
    guess : (c, d) contact forces where the iteration begins, N; those of the state if None
    workspace : its own, with linearisations that all presses share
    """

    formulation: FiniteStrain
    problem: Problem
    state: State[DeformedBody]
    guess: Float | None
    move: Move
    workspace: FiniteStrainWorkspace


def increments(several: Sequence[Beginning], leader: int) -> list[ContactSolution[State[DeformedBody]] | None]:
    """Advance several presses at once, on bodies with the same unknowns and contact points.

    Returns
    -------
    Solution of each press; None where it is to be solved by itself, see
    `finger3d.mechanics.finite_strain.together.solve_together`.
    """
    if any(_moves_too_far(one.problem, one.state, one.move) for one in several):
        return [None] * len(several)
    equations = [one.formulation.equations(one.problem, one.state, one.move, one.workspace) for one in several]
    solutions = solve_together(equations, [one.guess for one in several], leader)
    accepted = [
        found and one.formulation.accepted(increment, found)
        for one, increment, found in zip(several, equations, solutions, strict=True)
    ]
    return [one if one is not None and one.outcome.ok else None for one in accepted]


def _moved_points(problem: Problem, state: State[DeformedBody]) -> Float:
    """Return the displacements (c, d) mm of the contact points."""
    return np.asarray(problem.surface.trace @ displacement(problem.mesh, state.body.unknowns))


def _moves_too_far(problem: Problem, state: State[DeformedBody], move: Move) -> bool:
    carried = carried_by_object(problem, move, _moved_points(problem, state))
    return moves_too_far(problem, move, state.contact.gap, carried)
