"""Solution of one increment of frictional contact in 2D and 3D, checked against the contact conditions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final, Literal, NamedTuple, Protocol

import numpy as np

from finger3d._types import Float
from finger3d.contact.acceleration import accelerated_newton, threads_for
from finger3d.contact.conditions import TOLERANCE, ContactProblem, residual
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.lemke import friction_start
from finger3d.contact.newton import NewtonResult, block_gauss_seidel, force_of_sets, newton
from finger3d.contact.state import ContactSolution, ContactState, next_state, pressure
from finger3d.errors import Outcome

_FRICTION_UPDATES = 50
"""Updates of the friction coefficients allowed in an increment, and one more for every contact point."""

_FRICTION_TOLERANCE = 1e-10
"""Change of the friction coefficients, over the largest, at which they have converged; well below `TOLERANCE`."""


class _Limits(NamedTuple):
    """Limits of the attempts made when Newton's method fails.

    Attributes
    ----------
    lemke_rows : int
        Largest number of rows of the tableau of Lemke's method: 500 take 1 s, 2000 some 40 s.
    quick_lemke_rows : int
        Rows up to which it comes before the friction continuation in two dimensions, where its polygon is exact: where
        forces jump, the continuation mostly fails, after hundreds of Newton iterations.
    sweeps : tuple of int
        Gauss-Seidel sweeps before each of the last Newton attempts.
    """

    lemke_rows: int
    quick_lemke_rows: int
    sweeps: tuple[int, ...]


_SMALL_STRAIN = _Limits(2000, 700, (20, 50, 100, 200, 400, 800))
_FINITE_STRAIN = _Limits(500, 0, (20, 100))
"""At finite strain another linearisation, or half the increment, is cheaper than a long attempt."""

_FRICTION_CAPS = (1e4, np.inf, 1e3, 1e2)
"""Bounds of mu tried with Lemke's method: with mu = 1e6 round-off can spoil its pivots, and a smaller mu gives the
same active set."""

_SMALLEST_STRIDE = 1e-3
"""Stride of the friction continuation, as a share of the whole, at which it is given up."""


def solve_increment(problem: ContactProblem, guess: Float | None = None) -> ContactSolution[ContactState]:
    """Solve one increment.

    Parameters
    ----------
    problem : ContactProblem
        If its operator may be indefinite, the slowest attempts are left out, since another linearisation follows.
    guess : (c, d) array, N, optional
        Initial guess, by default the forces of the previous state.  It changes the iterations, not the solution.

    Returns
    -------
    ContactSolution
        Its outcome is CONVERGED only if the residual of the conditions, evaluated afterwards, is at most `TOLERANCE`.
    """
    previous = problem.previous
    law = problem.law
    if problem.refusal:
        return ContactSolution(previous, problem.refusal, np.inf, 0, "none")
    with threads_for(problem.free_motion.size):
        start = previous.force if guess is None else guess
        limits = _SMALL_STRAIN if problem.is_definite else _FINITE_STRAIN
        total = 0
        for _ in range(_FRICTION_UPDATES + len(start)):
            method, solution, error, spent = _solve_once(problem, start, guess is None, limits)
            total += spent
            if solution is None:
                break
            mu = law.updated(problem.friction, solution.status, pressure(solution.force, problem.area))
            if np.abs(mu - problem.friction).max(initial=0.0) <= _FRICTION_TOLERANCE * mu.max(initial=0.0):
                state = next_state(previous, solution.force, solution.relative_displacement, solution.status)
                return ContactSolution(state, Outcome.CONVERGED, error, total, method)
            problem = replace(problem, friction=mu)
            start = solution.force
    return ContactSolution(previous, Outcome.NO_CONVERGENCE, error, total, method)


def _solve_once(
    problem: ContactProblem, start: Float, path_turns: bool, limits: _Limits
) -> tuple[str, NewtonResult | None, float, int]:
    """Return method, solution, residual and iterations; None and the least residual if all attempts fail."""
    spent = 0
    least = np.inf
    for method, attempt in _attempts(problem, start, path_turns, limits):
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


def _attempts(
    problem: ContactProblem, start: Float, path_turns: bool, limits: _Limits
) -> Iterator[tuple[str, NewtonResult]]:
    """Yield attempts from the fastest to the most robust; each is made only if the one before failed.

    Where the path begins or turns, the start is far from the solution and full steps overshoot.
    """
    if path_turns:
        yield "newton", accelerated_newton(problem, start, 60, damped=True)
        yield "full steps", newton(problem, start, 30, damped=False)
    else:
        yield "newton", accelerated_newton(problem, start, 30, damped=False)
        yield "damped", newton(problem, start, 60, damped=True)
    pivots_first = problem.free_motion.shape[1] == 2 and 4 * len(start) <= limits.quick_lemke_rows
    if pivots_first:
        yield "pivots", _lemke_start(problem, start, limits.lemke_rows)
    yield "ramp", _friction_continuation(problem, start)
    if not pivots_first:
        yield "pivots", _lemke_start(problem, start, limits.lemke_rows)
    force = start
    for count in limits.sweeps:
        force = block_gauss_seidel(problem, force, count)
        attempt = newton(problem, force, 30, damped=True)
        yield "sweeps", replace(attempt, iterations=attempt.iterations + count)


def _lemke_start(problem: ContactProblem, start: Float, rows: int) -> NewtonResult:
    """Apply Newton's method from the active set of Lemke's method; points that then penetrate join, and it repeats."""
    spent = 0
    largest = float(problem.friction.max(initial=0.0))
    for cap in dict.fromkeys(min(cap, largest) for cap in _FRICTION_CAPS):
        capped = replace(problem, friction=np.minimum(problem.friction, cap))
        candidates = (problem.free_motion[:, 0] < 0.0) | (start[:, 0] > 0.0)
        for _ in range(5):
            active_set = friction_start(capped, np.flatnonzero(candidates), rows)
            if active_set is None:
                break
            status, direction = active_set
            try:
                force = force_of_sets(problem, status, np.hstack([np.zeros((len(status), 1)), direction]))
            except np.linalg.LinAlgError:
                break
            attempt = newton(problem, force, 30, damped=True)
            spent += attempt.iterations
            if attempt.solved:
                return replace(attempt, iterations=spent)
            penetrating = ~candidates & (problem.relative_displacement(force)[:, 0] < 0.0)
            if not penetrating.any():
                break
            candidates |= penetrating
    return NewtonResult(start, problem.relative_displacement(start), np.zeros(len(start), dtype=np.int8), False, spent)


def _friction_continuation(problem: ContactProblem, start: Float) -> NewtonResult:
    """Follow the solution from no friction to the coefficients of the problem, halving the stride where that fails."""
    solution = newton(replace(problem, friction=np.zeros_like(problem.friction)), start, 60, damped=True)
    spent = solution.iterations
    reached, stride = 0.0, 0.25
    # large coefficients only extend the stick zone, so that mu saturates as a function of the scale
    while solution.solved and reached < 1.0 and stride > _SMALLEST_STRIDE:
        scale = min(reached + stride, 1.0)
        mu = problem.friction if scale == 1.0 else problem.friction * scale / (1.0 + (1.0 - scale) * problem.friction)
        trial = newton(replace(problem, friction=mu), solution.force, 40, damped=True)
        spent += trial.iterations
        if trial.solved:
            solution = trial
            reached = scale
            stride *= 1.5
        else:
            stride *= 0.5
    return replace(solution, solved=reached >= 1.0, iterations=spent)


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
