"""Stick rules: algorithms that determine which points are open, stick or slip; a scene chooses one."""

from __future__ import annotations

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
