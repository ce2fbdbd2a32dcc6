"""Stick rules: algorithms that determine which points are open, stick or slip; a scene chooses one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal, Protocol

import numpy as np

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, ContactProblem, residual
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.newton import force_of_sets
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactSolution, ContactState, next_state
from finger3d.errors import Outcome

_MAX_ITERATIONS = 500

_SOLUTIONS = 4
"""Largest number of solutions in a search for the depth of a prescribed force."""

_INEXACT = 1e-2
"""Error of that force, over that of the first solution, at which the search ends."""


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
class ForceCondition:
    """Condition that the contact forces r add up to a prescribed normal force as the object is lowered further.

    Attributes
    ----------
    down : (c, d) relative displacement of the points, in their own directions, per distance that the object is lowered
        The normal force is ``-sum(down * r)``, by duality.
    force : N
    rate : of the force by the depth, as far as it is known, N/mm
    reach : mm, least and largest distance by which the object may be lowered
    tolerance : relative error of the force that is sought
    turned : (c, d) displacement of the points by forces that turn with the object's surface, per distance
    """

    down: Float
    force: float
    rate: float
    reach: tuple[float, float]
    tolerance: float
    turned: Float | float = 0.0


def solve_to_force(
    rule: RuleName, problem: ContactProblem, guess: Float | None, condition: ForceCondition
) -> tuple[ContactSolution[ContactState], float, float]:
    """Solve one increment, with the object lowered by the secant method until the forces meet a condition.

    The search ends early: at a hundredth of the first error, or after a few solutions.

    Returns
    -------
    solution : of the increment
    lowered : mm, by how much the object is lowered
    rate : of the force by the depth, N/mm
    """
    lowered, rate, last, moved = 0.0, condition.rate, (0.0, 0.0), condition.down + condition.turned
    allowed = condition.tolerance * condition.force
    for number in range(_SOLUTIONS):
        at_depth = replace(problem, free_motion=problem.free_motion + lowered * moved)
        solution = RULES[rule](at_depth, guess)
        if not solution.outcome.ok:
            break
        guess = solution.state.force
        reached = -float(np.sum(condition.down * guess))
        if number and (reached - last[1]) * (lowered - last[0]) > 0.0:
            rate = (reached - last[1]) / (lowered - last[0])
        error = abs(reached - condition.force)
        allowed = allowed if number else max(allowed, _INEXACT * error)
        last = lowered, reached
        if error <= allowed:
            break
        lowered = min(max(lowered + (condition.force - reached) / rate, condition.reach[0]), condition.reach[1])
    return solution, last[0], rate
