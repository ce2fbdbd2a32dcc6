"""Small strain with moduli that relax as a Prony series r(t) = 1 - sum g_i (1 - exp(-t/tau_i)).

With ``bulk`` Poisson's ratio is constant and everything follows from the instantaneous compliance C.  Let f_e be the
row forces that would hold the present shape of the elastic body, u = K^-1 B^T f_e; f is the convolution r * df_e/dt, or
``f = r_inf f_e + sum h_i`` with ``h_i' = e_i h_i + g_i gamma_i (f_e' - f_e)``, e_i = exp(-dt/tau_i) and
gamma_i = (1 - e_i) tau_i/dt: exact where f_e moves at a constant rate within the step (Taylor, Pister and Goudreau
1970).  So ``f_e' = (f + past)/alpha``, alpha = r_inf + sum g_i gamma_i: contact is solved with the compliance C/alpha
and points displaced by the past.  f_e is defined at all contact points: an open one has f = 0 but still creeps back.

Without ``bulk`` only the shear modulus relaxes.  The same holds of the shear part K_s of K = K_b + K_s, with the whole
displacement in place of f_e: one factorisation of K_b + alpha K_s for each length of step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.contact.state import ContactSolution
from finger3d.fem.laws.relaxation import InternalVariables, Relaxation, Step
from finger3d.fem.recovery.recover import displacement
from finger3d.fem.solvers.condense import spring_forces, stiffened
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.mechanics.discretise.problem import Problem, scatter_to_points
from finger3d.mechanics.formulation import Loads
from finger3d.mechanics.generalised import GeneralisedForces
from finger3d.mechanics.readings.columns import Column, of_kind
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.elastic import at_rest, linear_gap, linear_loads
from finger3d.mechanics.small_strain.linear_contact import LinearBody, solve_increment
from finger3d.mechanics.small_strain.viscoelastic_body import (
    ConstantBulkModulus,
    ConstantPoissonRatio,
    RelaxationWorkspace,
    Response,
)
from finger3d.objects import Move, ObjectPose


@dataclass(frozen=True)
class ViscousBody:
    """State of a relaxing body in small strain.

    Attributes
    ----------
    displacement : (c, d) mm of the contact points, in x, y, z
    memory : internal variables of the meshed part
    """

    displacement: Float
    memory: InternalVariables


@dataclass(frozen=True)
class Viscoelastic:
    """Small strain with relaxing moduli."""

    relaxation: Relaxation

    def workspace(self) -> RelaxationWorkspace:
        """Return a workspace without a factor."""
        return RelaxationWorkspace()

    def body(self, problem: Problem) -> ConstantPoissonRatio | ConstantBulkModulus:
        """Return the body of a problem."""
        return ConstantPoissonRatio(problem) if self.relaxation.bulk else ConstantBulkModulus(problem)

    def start(self, problem: Problem) -> State[ViscousBody]:
        """Return the state at rest, with internal variables zero."""
        self.relaxation.check_domain(problem.model.domain)
        empty = InternalVariables.at_rest(self.relaxation.prony, self.body(problem).size)
        return State(at_rest(problem), ViscousBody(np.zeros_like(problem.surface.points), empty))

    def increment(
        self,
        problem: Problem,
        state: State[ViscousBody],
        move: Move,
        guess: Float | None,
        workspace: RelaxationWorkspace,
        wanted: GeneralisedForces | None = None,
    ) -> ContactSolution[State[ViscousBody]]:
        """Apply the contact rule once, with the compliance for this time step and the displacement due to the past."""
        memory, step = state.body.memory, Step(self.relaxation.prony, move.duration_s)
        body, linear = self.respond(problem, memory, step, workspace)
        before = State(state.contact, state.body.displacement, state.last)
        solution = solve_increment(problem, before, move, linear, guess, workspace, wanted)
        if solution.state is before:
            return solution.with_state(state)
        contact = problem.row_forces(problem.upright_force(solution.state.contact))
        rows = problem.inclusions.with_spring_forces(body.compliance, contact, body.moved)
        after = ViscousBody(solution.state.body, step.after(memory, body.shape(rows)))
        return solution.with_state(State(solution.state.contact, after, solution.state.last))

    def respond(
        self, problem: Problem, memory: InternalVariables, step: Step, workspace: RelaxationWorkspace
    ) -> tuple[Response, LinearBody]:
        """Return the response of the condensed rows over a step, and of the contact points with what else there is."""
        body, springs = self.body(problem).respond(step, memory, workspace), problem.inclusions.bar_stiffness
        condensed, moved = body.compliance, body.moved
        first = len(condensed) - len(springs)
        if len(springs):
            moved = moved + condensed[:, first:] @ spring_forces(condensed, springs, moved)
        c, d = len(problem.surface.nodes), problem.dim
        past = np.zeros(c * d)
        past[problem.system.active_dofs] = moved[: len(problem.system.active_dofs)]
        # an elastic object does not relax
        rest = problem.delassus - scatter_to_points(
            stiffened(problem.body.condensed.compliance, springs), problem.system.active_dofs, c, d
        )
        delassus = scatter_to_points(stiffened(condensed, springs), problem.system.active_dofs, c, d) + rest
        return body, LinearBody(delassus, past.reshape(c, d))

    def unknowns(self, problem: Problem, states: Sequence[State[ViscousBody]]) -> Iterator[Float]:
        """Yield the unknowns of each state from its internal variables."""
        return (self.body(problem).unknowns(state.body.memory.elastic) for state in states)

    def readings(self, problem: Problem, state: State[ViscousBody]) -> dict[Column, float]:
        """Return the readings from the internal variables by their rows; pressures are those of the relaxed stress."""
        first, body, memory = len(problem.system.active_dofs), self.body(problem), state.body.memory
        rows = body.read(memory.elastic)[first:]
        values = dict(zip(problem.model.columns, map(float, rows), strict=False))
        if problem.model.taxels:
            forces = body.nodal_forces(self.relaxation.prony, memory)
            meshed, u = problem.meshed_body, np.zeros((0, problem.dim))
            pressures = (float(t.at_finite_strain(meshed, u, forces)[0]) for t in problem.model.taxels)
            values |= zip(of_kind(problem.model.columns, "taxel"), pressures, strict=True)
        return values

    def loads(self, problem: Problem, state: State[ViscousBody], pose: ObjectPose) -> Loads:
        """Return the forces of the points, at their centroids at rest."""
        return linear_loads(problem, state.contact, state.body.displacement)

    def gap(self, problem: Problem, u: Float, pose: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Return gaps and normals at the displaced points."""
        return linear_gap(problem, u, pose, surface)

    def fields(self, problem: Problem, state: State[ViscousBody]) -> tuple[Float, Float, Float]:
        """Return displacement, linear strain and relaxed stress."""
        unknowns = next(self.unknowns(problem, [state]))
        strain, _ = problem.strain_and_stress(unknowns)
        stress = self.body(problem).stress(self.relaxation.prony, state.body.memory)
        return displacement(problem.mesh, unknowns), strain, stress
