"""Finite strain: a hyperelastic body, and contact conditions on its deformed surface.

The presses iterate in step by the chord method: one elimination and one substitution of many right-hand sides cost a
fraction of those of one after another, and the rest of an iteration runs on all cores.  A new tangent is that of the
middle press among those whose residuals fall slowly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeVar

import numpy as np

from finger3d._machine import cores
from finger3d._types import Float
from finger3d.contact.acceleration import one_thread
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.hyperelastic import Hyperelastic, nodal_fields
from finger3d.fem.laws import IsochoricLaw
from finger3d.fem.laws.relaxation import InternalVariables, Relaxation, Step, relaxed
from finger3d.fem.mesh import quadrature
from finger3d.fem.recovery import displacement, extrapolated
from finger3d.fem.surface import BoundarySurface
from finger3d.fem.tensors import InvertedError, determinant
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.finite_strain.body import (
    DeformedBody,
    FiniteBody,
    FiniteStrainWorkspace,
    Linearisation,
    contact_of,
)
from finger3d.mechanics.finite_strain.equations import NEW_TANGENT, Configuration, IncrementEquations
from finger3d.mechanics.finite_strain.increment import FiniteIncrement, IncrementToForces
from finger3d.mechanics.formulation import Loads
from finger3d.mechanics.generalised import GeneralisedForces, forces_on
from finger3d.mechanics.history import State
from finger3d.mechanics.readings import Column, of_kind
from finger3d.mechanics.small_strain import carried_by_object, moves_too_far, passes_through, pulls
from finger3d.objects import Move, ObjectPose

T = TypeVar("T")

_ITERATIONS, _FACTORS = 40, 10
"""Largest number of iterations and of new factors in an increment."""

_ASTRAY, _DIVERGED = 0.1, 1.0
"""Residuals above which an iteration starts again with a new tangent, and with a new tangent is given up."""

_TOO_SLOW = 15
"""Remaining iterations above which a press should wait for a tangent nearer to its own."""


@dataclass
class _Trial:
    """Iteration of one press.

    Attributes
    ----------
    number : of the press
    first : configuration and contact forces (c, d) where it begins
    is_new : whether the tangent has been factored since
    slow : number of iterations after which more than `_TOO_SLOW` remained, with a tangent that served the leader
    """

    number: int
    equations: IncrementEquations
    first: tuple[Configuration, Float]
    now: Configuration = field(init=False)
    force: Float = field(init=False)
    out_of_balance: Float = field(init=False)
    error: float = math.inf
    last_error: float = math.inf
    spent: int = 0
    is_new: bool = False
    slow: int = 0
    solution: ContactSolution[ContactState] | None = None

    def __post_init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Go back to where the iteration began."""
        (self.now, self.force), self.error = self.first, math.inf
        self.out_of_balance = self.equations.out_of_balance(self.now, self.force)

    def contact(self, linearisation: Linearisation, displacement: Float) -> Float | None:
        """Solve contact; returns the changes (r,) of the forces on the rows, None if there is no solution."""
        _, self.solution, change = self.equations.contact(self.now, self.force, linearisation, displacement)
        self.spent += self.solution.iterations
        return change if self.solution.outcome.ok else None

    def move(self, step: Float) -> bool:
        """Take a step (N,); returns False if a cell would be inverted."""
        assert self.solution is not None
        if not np.isfinite(step).all():
            return False
        try:
            self.now, self.out_of_balance = self.equations.moved(self.now, step, self.solution.state.force)
        except InvertedError:
            return False
        self.force, self.last_error = self.solution.state.force, self.error
        self.error = self.equations.residual(self.now, self.solution.state, self.out_of_balance)
        return True

    @property
    def has_converged(self) -> bool:
        """Whether the iteration has ended."""
        return self.equations.has_converged(self.error, self.last_error)

    def lags(self) -> bool:
        """Count the iteration if more than `_TOO_SLOW` remain; return whether two have been counted."""
        self.slow += self.remaining > _TOO_SLOW
        return self.slow > 1

    @property
    def remaining(self) -> float:
        """Number of iterations until convergence, if the residual falls as it did."""
        return self.equations.remaining([self.last_error, self.error])


def solve_together(
    increments: Sequence[IncrementEquations], guesses: Sequence[Float | None], leader: int
) -> list[ContactSolution[State[DeformedBody]] | None]:
    """Solve an increment of several presses of one body, whose workspace they share.

    Parameters
    ----------
    leader : number of the press whose tangents are factored

    Returns
    -------
    Solution of each press, None where the iteration does not converge, or would converge faster with another tangent.
    """
    solutions: list[ContactSolution[State[DeformedBody]] | None] = [None] * len(increments)
    trials = [
        _Trial(n, increment, increment.initial(guess))
        for n, (increment, guess) in enumerate(zip(increments, guesses, strict=True))
    ]
    first, active, linearisation = trials[leader], trials, increments[0].last_linearisation()
    factors = 0
    with ThreadPoolExecutor(min(cores(), len(trials))) as pool:
        for _ in range(_ITERATIONS):
            if not active:
                break
            if linearisation is None:
                if factors == _FACTORS:
                    break
                linearisation, factors = first.equations.linearise(first.now, first.force), factors + 1
                for trial in active:
                    trial.is_new = True
            active = _advanced(active, linearisation, pool)
            for trial in active:
                if trial.has_converged:
                    assert trial.solution is not None
                    one = trial.equations.finished(trial.now, trial.solution, trial.error, trial.spent)
                    solutions[trial.number] = one if one.outcome.ok else None
            active = [trial for trial in active if not trial.has_converged]
            ahead = sum(max(trial.remaining - NEW_TANGENT, 0.0) for trial in active)
            if first in active and (first.remaining > _TOO_SLOW if factors else ahead > first.equations.factor_cost):
                linearisation = None
                for trial in active:
                    if not trial.is_new and trial.error > _ASTRAY:
                        trial.begin()
            elif factors or first not in active:
                active = [trial for trial in active if trial is first or not trial.lags()]
    return solutions


def _advanced(trials: list[_Trial], linearisation: Linearisation, pool: ThreadPoolExecutor) -> list[_Trial]:
    """Advance all trials by an iteration; returns those that may converge."""
    eliminated = linearisation.condensation.eliminated(-np.column_stack([trial.out_of_balance for trial in trials]))
    read = eliminated.displacement[linearisation.reads]
    changes = _mapped(pool, lambda trial, moved: trial.contact(linearisation, moved), trials, read.T)
    none = np.zeros(len(read))
    steps = eliminated.unknowns(np.column_stack([none if change is None else change for change in changes]))

    def moved(trial: _Trial, step: Float, change: Float | None) -> bool:
        if change is not None and trial.move(step):
            return not trial.is_new or trial.error <= _DIVERGED
        trial.begin()
        return not trial.is_new

    kept = _mapped(pool, moved, trials, steps.T, changes)
    return [trial for trial, is_kept in zip(trials, kept, strict=True) if is_kept]


def _mapped(pool: ThreadPoolExecutor, function: Callable[..., T], *arguments: Iterable[object]) -> list[T]:
    with one_thread():
        return list(pool.map(function, *arguments))


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
        if not solution.outcome.ok:
            return solution
        problem, start, move = increment.problem, increment.start, increment.move
        before, after = (_moved_points(problem, state) for state in (start, solution.state))
        through = passes_through(problem, move, before, after, start.contact.gap)
        if through or pulls(problem, start.contact, solution.state.contact, move):
            return replace(solution, state=start, outcome=Outcome.PASSED_THROUGH)
        memory, state = start.body.memory, solution.state
        if self.relaxation is not None and memory is not None:
            strained = increment.body.relaxing_variables(state.body.unknowns, self.relaxation.bulk)
            memory = Step(self.relaxation.prony, move.duration_s).after(memory, strained)
            state = replace(state, body=replace(state.body, memory=memory))
        return replace(solution, state=state)

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
    `finger3d.mechanics.finite_strain.formulation.solve_together`.
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
