"""Contact with prescribed resultants of its forces, each in place of a coordinate of the object."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from finger3d._types import Float
from finger3d.contact.acceleration import (
    FLOAT32_ITERATIONS,
    ShortProducts,
    chord_step,
    first_precision,
    threads_for,
    warm_start,
    while_it_pays,
)
from finger3d.contact.conditions import ContactProblem, residual
from finger3d.contact.newton import ActiveSet, ActiveSetSystem, Iterate, Precision
from finger3d.contact.solve import RULES, RuleName
from finger3d.contact.state import ContactSolution, ContactState, next_state, pressure
from finger3d.errors import Outcome

_BORDERED = 15
"""Largest number of iterations for contact forces and coordinates at once; few that converge need more."""

_SOLUTIONS = 6
"""Largest number of solutions in a search for the pose of prescribed forces."""

_SINGULAR, _UNREACHED = 1e-10, 1e-3
"""Singular value, over the largest, of a stiffness that counts as none, and part of the missing forces, left by a step
of Newton's method, from which the whole contact slips."""

_INEXACT = 1e-2
"""Error of those forces, over that of the first solution, at which the search ends."""


@dataclass(frozen=True)
class ForceConditions:
    """Conditions that the contact forces r have k resultants as the object moves by as many coordinates.

    Attributes
    ----------
    motion : (c d, k) relative displacement of the points, in their own directions, by each coordinate, also by forces
        that turn with the object's surface
    resultant : (c d, k), by which the resultants are ``-resultant.T r``
    forces : (k,) N, N mm
    scale : (k,) magnitudes to which errors of the forces are relative
    reach : (k,) largest change of each coordinate
    tolerance : relative error of the forces that is sought
    approach : (k,) step towards the finger where the object does not touch it
    """

    motion: Float
    resultant: Float
    forces: Float
    scale: Float
    reach: Float
    tolerance: float
    approach: Float

    def missing(self, force: Float) -> Float:
        """Return what contact forces (c, d) are short of (k,)."""
        return np.asarray(self.forces + self.resultant.T @ force.ravel())

    def error(self, force: Float) -> float:
        """Return the largest error of the resultants of contact forces (c, d), over their magnitudes."""
        return float(np.abs(self.missing(force) / self.scale).max())

    def moved(self, problem: ContactProblem, change: Float) -> ContactProblem:
        """Return a contact problem with the object moved by a change (k,) of the coordinates."""
        motion = (self.motion @ change).reshape(problem.free_motion.shape)
        return replace(problem, free_motion=problem.free_motion + motion)


class BorderedSystem(NamedTuple):
    """Equations of an active set, factored, bordered by those of the resultants.

    Attributes
    ----------
    system : of the active set
    conditions : of the resultants
    changes : (k, c, d) N, of the contact forces by each coordinate
    """

    system: ActiveSetSystem
    conditions: ForceConditions
    changes: Float

    @classmethod
    def of(
        cls, problem: ContactProblem, active: ActiveSet, conditions: ForceConditions, precision: Precision = np.float64
    ) -> BorderedSystem:
        """Assemble and factor the equations; raises LinAlgError if those of the active set are singular."""
        system = ActiveSetSystem.of(problem, active, precision)
        motion = conditions.motion.T.reshape(-1, *problem.free_motion.shape)
        changes = [active.force(system.solve(-active.weighted(problem, one))) for one in motion]
        return cls(system, conditions, np.array(changes))

    def closed(self, force: Float) -> tuple[Float, Float, Float | None]:
        """Return contact forces changed by the coordinates until they have the resultants.

        Returns
        -------
        force : (c, d) N
        step : (k,) of the coordinates
        lacking : (k,) forces over their magnitudes to which no step leads, as where the whole contact slips; else None
        """
        conditions, k = self.conditions, len(self.changes)
        stiffness = -conditions.resultant.T @ self.changes.reshape(k, force.size).T
        relative = stiffness * conditions.reach / conditions.scale[:, None]
        wanted = conditions.missing(force) / conditions.scale
        step = np.linalg.lstsq(relative, wanted, rcond=_SINGULAR)[0]
        lacking = wanted - relative @ step
        slips = np.linalg.norm(lacking) > _UNREACHED * np.linalg.norm(wanted)
        step = conditions.reach * step / max(1.0, float(np.abs(step).max(initial=0.0)))
        return force + np.einsum("k,kcd->cd", step, self.changes), step, lacking if slips else None


def solve_to_forces(
    rule: RuleName, problem: ContactProblem, guess: Float | None, conditions: ForceConditions
) -> tuple[ContactSolution[ContactState], Float, Float | None]:
    """Solve one increment, with the object moved until the forces meet conditions.

    Contact forces and coordinates are found at once by the semismooth Newton method.  Where it does not converge, the
    object is moved by Newton's method between solutions of the contact.  A step that does not lower the error is
    halved.  The search ends early: at a hundredth of the first error, or after a few solutions.

    Returns
    -------
    solution : of the increment
    moved : (k,) by how much the object is moved
    lacking : (k,) forces over their magnitudes to which no motion leads, if there are any
    """
    if rule == "projection" and (found := _at_once(problem, guess, conditions)):
        return *found, None
    lacking = None
    best: tuple[float, Float, ContactSolution[ContactState]] | None = None
    moved, step, allowed, spent = np.zeros(len(conditions.forces)), np.zeros(len(conditions.forces)), 0.0, 0
    for _ in range(_SOLUTIONS):
        there = conditions.moved(problem, moved)
        solution = RULES[rule](there, guess)
        spent += solution.iterations
        if not solution.outcome.ok and best is None:
            return solution, moved, lacking
        error = conditions.error(solution.state.force) if solution.outcome.ok else np.inf
        if best is not None and error >= best[0] and best[2].state.force.any():
            step = 0.5 * step
            moved = best[1] + step
            continue
        best, guess = (error, moved, solution), solution.state.force
        allowed = allowed or max(conditions.tolerance, _INEXACT * error)
        if error <= allowed:
            break
        if not guess.any():
            step = conditions.approach
            if not step.any():
                break
        else:
            augmented = Iterate.of(there, guess).augmented_force
            try:
                bordered = BorderedSystem.of(there, ActiveSet.of(there, solution.state.status, augmented), conditions)
            except np.linalg.LinAlgError:
                break
            _, step, lacking = bordered.closed(bordered.system.solution())
            if lacking is not None:
                break
        moved = moved + step
    assert best is not None
    return replace(best[2], iterations=spent), best[1], lacking


class _Trial(NamedTuple):
    """Iterate of contact forces and coordinates: the problem with the object moved by `moved` (k,)."""

    problem: ContactProblem
    moved: Float
    iterate: Iterate

    @property
    def mismatch(self) -> float:
        return self.iterate.mismatch

    def stepped(self, conditions: ForceConditions, force: Float, step: Float) -> _Trial:
        problem = conditions.moved(self.problem, step)
        return _Trial(problem, self.moved + step, Iterate.of(problem, force))

    def solves(self, conditions: ForceConditions) -> bool:
        met = conditions.error(self.iterate.force) <= conditions.tolerance
        return met and self.iterate.satisfies(self.problem, self.iterate.status)


def _at_once(
    problem: ContactProblem, guess: Float | None, conditions: ForceConditions
) -> tuple[ContactSolution[ContactState], Float] | None:
    """Solve one increment by Newton's method for contact forces and coordinates, bordered by those of the coordinates.

    Returns
    -------
    The solution and by how much the object is moved (k,); None where the iteration does not converge.
    """
    if problem.refusal:
        return None
    short = ShortProducts(**vars(problem))
    with threads_for(problem.free_motion.size):
        force = warm_start(short, problem.previous.force if guess is None else guess)
        now = _Trial(short, np.zeros(len(conditions.forces)), Iterate.of(short, force))
        for iteration in range(_BORDERED + 1):
            if now.solves(conditions):
                return _solution(now, iteration)
            active = ActiveSet.of(now.problem, now.iterate.status, now.iterate.augmented_force)
            if not active.size:
                return None
            precision = first_precision(problem) if iteration < FLOAT32_ITERATIONS else np.float64
            try:
                bordered = BorderedSystem.of(now.problem, active, conditions, precision)
                force, step, lacking = bordered.closed(bordered.system.solution())
            except np.linalg.LinAlgError:
                return None
            if lacking is not None or not np.isfinite(force).all():
                return None
            now = _corrected(now.stepped(conditions, force, step), bordered, now.iterate)
    return None


def _corrected(trial: _Trial, bordered: BorderedSystem, before: Iterate) -> _Trial:
    """Return a trial after chord iterations with the factors of the step to it, while the active set stays the same."""
    conditions = bordered.conditions

    def step(now: _Trial) -> _Trial:
        force, projected = now.iterate.force, now.iterate.projected
        return now.stepped(conditions, *bordered.closed(chord_step(bordered.system, force, force - projected))[:2])

    def ends(now: _Trial) -> bool:
        return bool((now.iterate.status != before.status).any()) or now.solves(conditions)

    return trial if bordered.system.is_exact else while_it_pays(trial, step, ends)


def _solution(found: _Trial, iterations: int) -> tuple[ContactSolution[ContactState], Float] | None:
    """Return the solution and the motion of the object; None where friction has changed with the pressure."""
    problem, now = found.problem, found.iterate
    mu = problem.law.updated(problem.friction, now.status, pressure(now.force, problem.area))
    if (mu != problem.friction).any():
        return None
    missed = residual(now.force, now.displacement, now.status, mu, problem.length_scale)
    state = next_state(problem.previous, now.force, now.displacement, now.status)
    return ContactSolution(state, Outcome.CONVERGED, missed, iterations, "newton"), found.moved
