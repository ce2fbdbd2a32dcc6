"""One increment of frictional contact: the same stick and slip conditions in 2D and 3D, solved and then proved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.conditions import TOLERANCE, ContactProblem, augmentation_parameters, residual
from finger3d.contact.friction import FrictionLaw
from finger3d.contact.initial_guess import initial_guess
from finger3d.contact.lemke import friction_start
from finger3d.contact.newton import Iterate, block_gauss_seidel, force_of_sets, mixed_precision_newton, newton
from finger3d.contact.state import ContactSolution, ContactState, invalid_input, next_state, pressure
from finger3d.contact.threads import threads_for
from finger3d.errors import Outcome

Float = NDArray[np.float64]

_FRICTION_UPDATES = 50
"""Updates of the friction coefficients allowed in an increment, and one more for every contact point."""

_FRICTION_TOLERANCE = 1e-10
"""Change of the friction coefficients, over the largest, at which they have converged; well below `TOLERANCE`."""


def solve_increment(
    previous: ContactState,
    free: Float,
    compliance: Float,
    law: FrictionLaw,
    length_scale: float,
    guess: Float | None = None,
    weights: Float | None = None,
    area: Float | None = None,
) -> ContactSolution:
    """Solve one increment.

    Parameters
    ----------
    previous : state at its begin
    free : (c, d) mm
        Gap, and tangential position relative to the object, that each point would have under no contact force.
    compliance : (c, d, c, d) mm/N
    law : FrictionLaw
    length_scale : mm
        What gaps are measured by in the residual: the depth.
    guess : (c, d) N
        Where to start, the forces before the increment unless given.  It saves iterations, and decides nothing.
    weights : (c, d) N/mm
        What weighs a gap against a force, from the compliance's diagonal unless given.  With them an indefinite
        compliance is taken: at finite strain a body under its contact forces may be stable by the contact alone.
    area : (c,) mm2
        Tributary areas of the points; only laws whose coefficient depends on the pressure need them.

    Returns
    -------
    Increment
        With outcome CONVERGED only if every condition holds to 1e-8, checked after the solution.
    """
    c, d = free.shape
    matrix = compliance.reshape(c * d, c * d)
    with threads_for(c * d, d > 2):  # in 3D Newton factors by SciPy
        refused = invalid_input(free, matrix, weights is None)
        if refused:
            return ContactSolution(previous, refused, np.inf, 0, "none")
        change = free.copy()
        change[:, 1:] -= previous.tangential_displacement
        rho = augmentation_parameters(matrix, d) if weights is None else weights
        mu = law.coefficients(previous.status, pressure(previous.force, area))
        start = previous.force if guess is None else guess
        total = 0
        for _ in range(_FRICTION_UPDATES + c):
            problem = ContactProblem(change, matrix, mu, rho, length_scale)
            method, found, error, spent = _settle(problem, start, guess is None)
            total += spent
            if found is None:
                return ContactSolution(previous, Outcome.NO_CONVERGENCE, error, total, method)
            updated = law.updated(mu, found.status, pressure(found.force, area))
            if np.abs(updated - mu).max(initial=0.0) <= _FRICTION_TOLERANCE * updated.max(initial=0.0):
                break
            mu, start = updated, found.force
        else:
            return ContactSolution(previous, Outcome.NO_CONVERGENCE, error, total, method)
        state = next_state(previous, found.force, found.relative_displacement, found.status)
    return ContactSolution(state, Outcome.CONVERGED, error, total, method)


def _settle(problem: ContactProblem, start: Float, turns: bool) -> tuple[str, Iterate | None, float, int]:
    """Method, solution, its residual and the iterations spent; None and the least residual where all attempts fail."""
    spent, least = 0, np.inf
    for method, attempt in _ladder(problem, start, turns):
        spent += attempt.iterations
        if not attempt.solved:
            continue
        error = residual(
            attempt.force, attempt.relative_displacement, attempt.status, problem.friction, problem.length_scale
        )
        if error <= TOLERANCE:
            return method, attempt, error, spent
        least = min(least, error)
    return "none", None, least, spent


def _ladder(problem: ContactProblem, start: Float, turns: bool) -> Iterator[tuple[str, Iterate]]:
    """Attempts from the fastest to the most patient; each is tried only if the one before failed.

    Where the path begins or turns the start is far away: full steps overshoot there, and come back to where they were.
    """
    near = initial_guess(problem, start)
    if turns:
        yield "newton", mixed_precision_newton(problem, near, 60, damped=True)
        yield "full steps", newton(problem, start, 30, damped=False)
    else:
        yield "newton", mixed_precision_newton(problem, near, 30, damped=False)
        yield "damped", newton(problem, start, 60, damped=True)
    yield "ramp", _ramp(problem, start)
    yield "pivots", _pivots(problem, start)
    force, spent = start, 0
    for count in (20, 50, 100, 200, 400, 800):
        force = block_gauss_seidel(problem, force, count)
        spent = count
        attempt = newton(problem, force, 30, damped=True)
        yield "sweeps", replace(attempt, iterations=attempt.iterations + spent)


def _pivots(problem: ContactProblem, start: Float) -> Iterate:
    """Newton from the sets that Lemke's method finds; points it lets through the object join, and it is asked again.

    A coefficient of 1e6 can cost the pivots their digits; the sets under a smaller one are then the same.
    """
    spent = 0
    for cap in (np.inf, 1e4, 1e3, 1e2):
        if np.isfinite(cap) and problem.friction.max(initial=0.0) <= cap:
            continue
        capped = replace(problem, friction=np.minimum(problem.friction, cap))
        inside = (problem.free_motion[:, 0] < 0.0) | (start[:, 0] > 0.0)
        for _ in range(5):
            found = friction_start(capped, np.flatnonzero(inside))
            if found is None:
                break
            status, direction = found
            try:
                force = force_of_sets(problem, status, np.hstack([np.zeros((len(status), 1)), direction]))
            except np.linalg.LinAlgError:
                break
            attempt = newton(problem, force, 30, damped=True)
            spent += attempt.iterations
            if attempt.solved:
                return replace(attempt, iterations=spent)
            beyond = ~inside & (problem.relative_displacement(force)[:, 0] < 0.0)
            if not beyond.any():
                break
            inside |= beyond
    return Iterate(start, problem.relative_displacement(start), np.zeros(len(start), dtype=np.int8), False, spent)


def _ramp(problem: ContactProblem, start: Float) -> Iterate:
    """Follow the solution from no friction to the coefficient asked for, halving the stride where it breaks."""
    found = newton(replace(problem, friction=np.zeros_like(problem.friction)), start, 60, damped=True)
    spent = found.iterations
    reached, stride = 0.0, 0.25
    # beyond mu ~ 5 nothing changes but full stick, so the share runs over a saturating scale
    while found.solved and reached < 1.0 and stride > 1e-3:
        share = min(reached + stride, 1.0)
        mu = problem.friction if share == 1.0 else problem.friction * share / (1.0 + (1.0 - share) * problem.friction)
        trial = newton(replace(problem, friction=mu), found.force, 40, damped=True)
        spent += trial.iterations
        if trial.solved:
            found, reached, stride = trial, share, stride * 1.5
        else:
            stride *= 0.5
    return replace(found, solved=reached >= 1.0, iterations=spent)
