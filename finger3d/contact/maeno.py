"""The paper's rule to the letter: swap every node that violates its equation, and solve again (Maeno 2004, Sec. II-A).

Kept for reproduction.  It has no way back from slip to stick within an increment, does not ask that friction oppose
slip, and repeats states where the mesh is fine or nu is high; an increment that does so is reported as cycled.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.conditions import TOLERANCE, ContactProblem, augmentation_parameters, residual
from finger3d.contact.friction import OPEN, SLIP, STICK, FrictionLaw
from finger3d.contact.newton import force_of_sets
from finger3d.contact.state import ContactSolution, ContactState, invalid_input, next_state, pressure
from finger3d.errors import Outcome

Float = NDArray[np.float64]

_LIMIT = 500


def maeno_active_set(
    previous: ContactState,
    free: Float,
    compliance: Float,
    law: FrictionLaw,
    length_scale: float,
    guess: Float | None = None,
    weights: Float | None = None,
    area: Float | None = None,
) -> ContactSolution:
    """Solve one increment by the paper's swaps; arguments as for `advance`; the guess is not used.

    A cycled increment hands on the last state it tried, so that a run can go on and show what became of it.
    """
    c, d = free.shape
    matrix = compliance.reshape(c * d, c * d)
    refused = invalid_input(free, matrix, weights is None)
    if refused:
        return ContactSolution(previous, refused, np.inf, 0, "none")
    change = free.copy()
    change[:, 1:] -= previous.tangential_displacement
    mu = law.coefficients(previous.status, pressure(previous.force, area))
    rho = augmentation_parameters(matrix, d) if weights is None else weights
    problem = ContactProblem(change, matrix, mu, rho, length_scale)
    # in the last time frame's contact: stuck; all others: free
    status = np.where(previous.status == OPEN, OPEN, STICK).astype(np.int8)
    direction = np.zeros((c, d))
    seen = set()
    for iteration in range(1, _LIMIT + 1):
        seen.add(status.tobytes())
        force = force_of_sets(problem, status, direction)
        moved = problem.relative_displacement(force)
        length = np.linalg.norm(force[:, 1:], axis=1)
        swapped = status.copy()
        swapped[(status == OPEN) & (moved[:, 0] < 0.0)] = STICK
        swapped[(status != OPEN) & (force[:, 0] <= 0.0)] = OPEN
        slips = (status == STICK) & (swapped == STICK) & ((length >= mu * force[:, 0]) | (mu == 0.0))
        swapped[slips] = SLIP
        direction[slips, 1:] = force[slips, 1:]
        if np.array_equal(swapped, status):
            return _judged(previous, problem, force, moved, status, iteration)
        status = swapped
        if status.tobytes() in seen:
            break
    error = residual(force, moved, status, mu, length_scale)
    return ContactSolution(next_state(previous, force, moved, status), Outcome.CYCLED, error, iteration, "paper")


def _judged(
    previous: ContactState,
    problem: ContactProblem,
    force: Float,
    moved: Float,
    status: NDArray[np.int8],
    iterations: int,
) -> ContactSolution:
    """Eqs. (1)-(4) hold; whether friction also opposes slip decides if the step may call itself converged."""
    error = residual(force, moved, status, problem.friction, problem.length_scale)
    outcome = Outcome.CONVERGED if error <= TOLERANCE else Outcome.WRONG_WAY
    return ContactSolution(next_state(previous, force, moved, status), outcome, error, iterations, "paper")
