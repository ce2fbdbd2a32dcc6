"""Stick rules: algorithms that determine which points are open, stick or slip; a scene chooses one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal, Protocol

import numpy as np

from finger3d._types import Float
from finger3d.contact.acceleration import assemble_in_place, warm_start
from finger3d.contact.conditions import TOLERANCE, ContactProblem, residual
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.newton import ActiveSet, ActiveSetSystem, Iterate, force_of_sets
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactSolution, ContactState, next_state, pressure
from finger3d.errors import Outcome

_MAX_ITERATIONS = 500

_BORDERED = 15
"""Largest number of iterations for contact forces and coordinates at once; few that converge need more."""

_SOLUTIONS = 6
"""Largest number of solutions in a search for the pose of prescribed forces."""

_SINGULAR, _UNREACHED = 1e-10, 1e-3
"""Singular value, over the largest, of a stiffness that counts as none, and part of the missing forces, left by a step
of Newton's method, from which the whole contact slips."""

_INEXACT = 1e-2
"""Error of those forces, over that of the first solution, at which the search ends."""


def maeno_active_set(problem: ContactProblem, guess: Float | None = None) -> ContactSolution[ContactState]:
    """Solve one increment by the rule of Maeno 2004, Sec. II-A: change all points that violate an equation, and repeat.

    Kept for reproduction.  Within an increment a slipping point never returns to stick, friction need not oppose slip,
    and on fine meshes or at high nu the active sets repeat; such an increment is reported as cycled, and has the last
    state that was tried.  The guess is not used, and the friction coefficients stay those at the beginning of the
    increment.
    """
    previous, mu = problem.previous, problem.friction
    c, d = problem.free_motion.shape
    if problem.refusal:
        return ContactSolution(previous, problem.refusal, np.inf, 0, "none")
    # points that touched at the end of the last increment stick, all others are open
    status = np.where(previous.status == OPEN, OPEN, STICK).astype(np.int8)
    direction = np.zeros((c, d))
    seen: set[bytes] = set()
    outcome = Outcome.CYCLED
    for iteration in range(1, _MAX_ITERATIONS + 1):  # noqa: B007  the count is part of the result
        seen.add(status.tobytes())
        force = force_of_sets(problem, status, direction)
        displacement = problem.relative_displacement(force)
        length = np.linalg.norm(force[:, 1:], axis=1)
        changed = status.copy()
        changed[(status == OPEN) & (displacement[:, 0] < 0.0)] = STICK
        changed[(status != OPEN) & (force[:, 0] <= 0.0)] = OPEN
        slips = (status == STICK) & (changed == STICK) & ((length >= mu * force[:, 0]) | (mu == 0.0))
        changed[slips] = SLIP
        direction[slips, 1:] = force[slips, 1:]
        if np.array_equal(changed, status):  # Eqs. (1)-(4) hold, but friction need not oppose slip
            outcome = Outcome.CONVERGED
            break
        status = changed
        if status.tobytes() in seen:
            break
    error = residual(force, displacement, status, mu, problem.length_scale)
    if outcome is Outcome.CONVERGED and error > TOLERANCE:
        outcome = Outcome.WRONG_WAY
    return ContactSolution(next_state(previous, force, displacement, status), outcome, error, iteration, "paper")


class StickRule(Protocol):
    """Solution of one increment."""

    def __call__(self, problem: ContactProblem, guess: Float | None = None) -> ContactSolution[ContactState]:
        """Solve one increment, from an initial guess (c, d) N of the forces if there is one."""
        ...


RuleName = Literal["projection", "paper"]

RULES: Final[dict[RuleName, StickRule]] = {"projection": solve_increment, "paper": maeno_active_set}

STEP_DEPENDENT_RULES: Final[frozenset[RuleName]] = frozenset({"paper"})
"""Rules whose increments are never cut and may end in a cycle, so that the result depends on the increments."""


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

    def newton_step(self, problem: ContactProblem, active: ActiveSet) -> tuple[Float, Float, Float | None]:
        """Return a step of Newton's method for contact forces and coordinates.

        The equations of the active set are bordered by those of the resultants.

        Returns
        -------
        force : (c, d) N, at its end
        step : (k,) of the coordinates
        lacking : (k,) forces over their magnitudes to which no step leads, as where the whole contact slips; else None

        Raises
        ------
        LinAlgError
            If the equations of the active set are singular.
        """
        system, shape = ActiveSetSystem.of(problem, active, assembly=assemble_in_place), problem.free_motion.shape
        force = system.solution()
        motion = self.motion.T.reshape(len(self.forces), *shape)
        changes = np.array([active.force(system.solve(-active.weighted(problem, one))) for one in motion])
        stiffness = -self.resultant.T @ changes.reshape(len(motion), force.size).T
        relative, wanted = stiffness * self.reach / self.scale[:, None], self.missing(force) / self.scale
        step = np.linalg.lstsq(relative, wanted, rcond=_SINGULAR)[0]
        lacking = wanted - relative @ step
        slips = np.linalg.norm(lacking) > _UNREACHED * np.linalg.norm(wanted)
        step = self.reach * step / max(1.0, float(np.abs(step).max(initial=0.0)))
        return force + np.einsum("k,kcd->cd", step, changes), step, lacking if slips else None


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
                _, step, lacking = conditions.newton_step(there, ActiveSet.of(there, solution.state.status, augmented))
            except np.linalg.LinAlgError:
                break
            if lacking is not None:
                break
        moved = moved + step
    assert best is not None
    return replace(best[2], iterations=spent), best[1], lacking


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
    moved, there = np.zeros(len(conditions.forces)), problem
    force = warm_start(problem, problem.previous.force if guess is None else guess)
    for iteration in range(_BORDERED + 1):
        current = Iterate.of(there, force)
        if conditions.error(force) <= conditions.tolerance and current.satisfies(there, current.status):
            mu = problem.law.friction.updated(problem.friction, current.status, pressure(force, problem.area))
            if (mu != problem.friction).any():
                return None
            missed = residual(force, current.displacement, current.status, mu, problem.length_scale)
            state = next_state(problem.previous, force, current.displacement, current.status)
            return ContactSolution(state, Outcome.CONVERGED, missed, iteration, "newton"), moved
        active = ActiveSet.of(there, current.status, current.augmented_force)
        if not active.size:
            return None
        try:
            force, step, lacking = conditions.newton_step(there, active)
        except np.linalg.LinAlgError:
            return None
        if lacking is not None or not np.isfinite(force).all():
            return None
        moved = moved + step
        there = conditions.moved(problem, moved)
    return None
