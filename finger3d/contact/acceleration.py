"""Accelerations of the Newton method: they change the time that an increment takes, not its solution.

- Warm start: the initial guess alternates a normal contact problem (friction fixed) and a friction problem (normal
  forces fixed), each solved approximately (Panagiotopoulos 1975).
- Mixed precision: in 3D and under moderate friction the matrices are factored in single precision.
- Chord iterations: the factors are reused while they reduce the residual.
- Products with the Delassus operator end at the last point that bears a force; the deepest points come first.
- BLAS runs on one thread where matrices are small.

Systems are factored, not iterated: on fingers GMRES needs 65 to 80 products to 1e-8, which takes five times as long as
the factors with 2 700 rows and as long with 10 000.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from finger3d._types import Float
from finger3d.contact.conditions import ContactProblem, lengths, project_on_friction_cone
from finger3d.contact.newton import (
    ActiveSet,
    ActiveSetSystem,
    Iterate,
    NewtonResult,
    Precision,
    lu_solver,
    newton,
    submatrix,
)

Array = NDArray[np.floating[Any]]
Solve = Callable[[Array], Array]

_PRECISION: dict[int, Precision] = {1: np.float64, 2: np.float64, 3: np.float32}
"""Precision of the initial guess and of the first factors, by dimension; matrices of 2D fit into the cache anyway."""

FLOAT32_ITERATIONS = 4
"""Newton iterations that are tried in single precision."""

_FLOAT32_MAX_MU = 2.0
"""Largest mu for which single precision is tried; above it round-off often prevents convergence."""

_CHORD_ITERATIONS = 12
"""Largest number of chord iterations with one factor."""

_CHORD_RATIO = 0.1
"""Ratio of mismatches above which another chord iteration does not pay: one costs a tenth of a factorisation."""

_ACTIVE_SETS = 12
"""Active sets tried for the normal contact problem."""

_DEEP = 0.6
"""Share of the newly penetrating points that will touch; 0.5 to 0.67 under a cylinder."""

_FRICTION_STEPS, _ALTERNATE_EVERY = 40, 8
"""Largest number of projected-gradient steps of the friction, and of those between two updates of the normal forces."""

_FRICTION_CHANGE, _NORMAL_CHANGE = 1e-4, 1e-3
"""Relative changes of friction and normal forces at which the initial guess is accepted."""

_NEARLY_FIXED = 1e-2
"""Relative mismatch below which the expected forces are the initial guess themselves."""

_ONE_THREAD_BELOW = 3000
"""Rows of the Delassus operator below which two threads gain little; on a busy machine they lose a factor of 10."""


def accelerated_newton(problem: ContactProblem, expected: Float, limit: int, damped: bool) -> NewtonResult:
    """Solve as `finger3d.contact.newton.newton` does, from expected forces (c, d), N, with all accelerations."""
    problem = ShortProducts(**vars(problem))
    start = warm_start(problem, expected)
    precision = first_precision(problem)
    spent = 0
    if precision is np.float32:
        single = newton(problem, start, FLOAT32_ITERATIONS, damped, precision, chord_iterations)
        if single.solved:
            return single
        spent = single.iterations
    double = newton(problem, start, limit, damped, correct=chord_iterations)
    return replace(double, iterations=spent + double.iterations)


def first_precision(problem: ContactProblem) -> Precision:
    """Return the precision of the first factors: single in 3D and under moderate friction."""
    moderate = problem.friction.max(initial=0.0) <= _FLOAT32_MAX_MU
    return _PRECISION[problem.free_motion.shape[1]] if moderate else np.float64


@cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController().select(user_api="blas")


def one_thread() -> AbstractContextManager[object]:
    """Return a context in which dense algebra runs on one thread."""
    context: AbstractContextManager[object] = _blas().limit(limits=1)
    return context


def threads_for(rows: int) -> AbstractContextManager[object]:
    """Return a context in which dense algebra with so many rows runs on as many threads as help it."""
    return one_thread() if rows < _ONE_THREAD_BELOW else nullcontext()


class ShortProducts(ContactProblem):
    """Contact problem whose products end at the last point that bears a force."""

    def relative_displacement(self, force: Float) -> Float:
        return self.free_motion + self._times(self.delassus, force).reshape(force.shape)

    def gap(self, force: Float) -> Float:
        return self.free_motion[:, 0] + self._times(self.delassus[:: force.shape[1]], force)

    @staticmethod
    def _times(rows: Float, force: Float) -> Float:
        forces = force.ravel()
        count = int(np.flatnonzero(forces)[-1:].sum()) + 1 if forces.any() else 0
        return rows[:, :count] @ forces[:count]


def chord_iterations(problem: ContactProblem, system: ActiveSetSystem, initial: Iterate) -> Iterate:
    """Return the better of an iterate and the result of chord iterations with its factors.

    They update the slip directions and remove the round-off of single precision, while the active set stays the same.
    """
    if initial.at_roundoff(problem) or system.is_exact:
        return initial
    best = while_it_pays(
        Iterate.of(problem, _scale_to_slip_limit(system.active, initial.force)),
        lambda now: Iterate.of(problem, chord_step(system, now.force, now.force - now.projected)),
        lambda now: now.at_roundoff(problem) or bool((now.status != initial.status).any()),
    )
    return min(initial, best, key=lambda iterate: iterate.mismatch)


class _HasMismatch(Protocol):
    @property
    def mismatch(self) -> float: ...


It = TypeVar("It", bound=_HasMismatch)


def while_it_pays(best: It, step: Callable[[It], It], ends: Callable[[It], bool]) -> It:
    """Return the best of an iterate and those to which steps with the same factors lead, until one does not pay."""
    for _ in range(_CHORD_ITERATIONS):
        if ends(best):
            break
        candidate = step(best)
        stalls = not candidate.mismatch <= _CHORD_RATIO * best.mismatch
        best = min(best, candidate, key=lambda iterate: iterate.mismatch)
        if stalls:
            break
    return best


def chord_step(system: ActiveSetSystem, force: Float, mismatch: Float) -> Float:
    """Return the forces (c, d) of a Newton step with a factor of slightly different slip directions.

    The equations hold only for friction of length mu r_n at the slipping points of `force`; `mismatch` (c, d) is the
    difference between `force` and its projection.
    """
    active = system.active
    across = np.sum(mismatch[active.slip_points, 1:] * active.tangent, axis=1)
    change = system.solve(-np.concatenate([mismatch.ravel()[active.active_dofs], across]))
    return _scale_to_slip_limit(active, force + active.force(change))


def _scale_to_slip_limit(active: ActiveSet, force: Float) -> Float:
    """Return the forces (c, d) with friction of length mu r_n at slipping points, its direction unchanged."""
    scaled = force.copy()
    slip = active.slip_points
    length = lengths(scaled[slip, 1:])
    limit = lengths(active.slip_force_direction) * scaled[slip, 0]
    scaled[slip, 1:] *= (limit / np.where(length > 0.0, length, 1.0))[:, None]
    return scaled


def warm_start(problem: ContactProblem, expected: Float) -> Float:
    """Return an initial guess (c, d), N, from expected forces; these themselves if they nearly solve the problem."""
    gap = problem.gap(expected)
    touched, touches = expected[:, 0] > 0.0, expected[:, 0] > problem.augmentation[:, 0] * gap
    if (touched == touches).all() and _is_nearly_fixed_point(problem, expected):
        return expected
    guess = np.zeros_like(expected)
    try:
        closing = touches & ~touched
        points, normal, solve_normal = _normal_contact(problem, expected, touches & (touched | _deepest(gap, closing)))
        if len(points) and expected.shape[1] > 1:
            active = _ActivePoints.of(problem, points, solve_normal)
            with np.errstate(over="ignore", invalid="ignore"):  # a guess that is not finite is no better than none
                guess[points] = _alternate(active, normal, expected[points, 1:].astype(normal.dtype))
        else:
            guess[points, 0] = normal
    except np.linalg.LinAlgError:  # a body without support, or an indefinite operator
        return expected
    return guess


def _is_nearly_fixed_point(problem: ContactProblem, force: Float) -> bool:
    mismatch = force - project_on_friction_cone(problem, force, problem.relative_displacement(force))[0]
    return float(np.linalg.norm(mismatch)) <= _NEARLY_FIXED * float(np.linalg.norm(force))


def _deepest(gap: Float, closing: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which points (c,) are as deep as the deepest share `_DEEP` of those that close; others will open again."""
    return gap <= np.quantile(gap[closing], _DEEP) if closing.any() else closing


def _normal_contact(
    problem: ContactProblem, expected: Float, touches: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], Array, Solve]:
    """Solve the normal contact problem under the expected friction by an active-set strategy.

    Returns
    -------
    points : (k,) array
        Points that touch.
    normal : (k,) array, N
    solve_normal : callable
        Normal forces (k,) that change the gaps by a given amount (k,).
    """
    d = expected.shape[1]
    force = expected.copy()
    force[:, 0] = 0.0
    open_gap = problem.gap(force)
    for _ in range(_ACTIVE_SETS):
        points = np.flatnonzero(touches)
        solve_normal: Solve = lu_solver(submatrix(problem.delassus, points * d, _PRECISION[d]), reuse=d > 2)
        force[:] = 0.0
        penetration: Array = (-open_gap[points]).astype(_PRECISION[d])
        force[points, 0] = normal = solve_normal(penetration)
        gap = open_gap + problem.gap(force) - problem.free_motion[:, 0]
        last, touches = touches, force[:, 0] > problem.augmentation[:, 0] * gap
        if (touches == last).all():
            break
    return points, np.maximum(normal, 0.0), solve_normal


class _ActivePoints(NamedTuple):
    """Blocks of the Delassus operator between k points that touch.

    Tangential components come direction by direction: `coupling` (k, k (d - 1)) is between normals and tangents,
    `tangential` (k (d - 1), k (d - 1)) between tangents; `gap` (k,) and `slip` (k (d - 1),) mm are the free motion;
    `step` (k (d - 1),) N/mm is the step of the projected gradient.
    """

    gap: Array
    slip: Array
    solve_normal: Solve
    coupling: Array
    tangential: Array
    mu: Array
    step: Array

    @classmethod
    def of(cls, problem: ContactProblem, points: NDArray[np.int64], solve_normal: Solve) -> _ActivePoints:
        d, k = problem.free_motion.shape[1], len(points)
        dofs = (np.arange(d)[:, None] + points * d).ravel()
        block = submatrix(problem.delassus, dofs, _PRECISION[d])
        free, rho = (a.ravel()[dofs].astype(block.dtype) for a in (problem.free_motion, problem.augmentation))
        coupling, tangential = block[:k, k:], block[k:, k:]
        rho = rho[k:]
        mu = problem.friction[points].astype(block.dtype)
        step = rho / _spectral_radius(tangential, rho)
        return cls(free[:k], free[k:], solve_normal, coupling, tangential, mu, step)

    def slip_and_limit(self, normal: Array) -> tuple[Array, Array]:
        """Return the slip (k (d - 1),) mm without friction under normal forces (k,), and the friction limit (k,) N."""
        return self.slip + normal @ self.coupling, self.mu * normal

    def normal_forces(self, friction: Array) -> Array:
        """Return the normal forces (k,) under friction (k (d - 1),)."""
        return np.maximum(self.solve_normal(-(self.gap + self.coupling @ friction)), 0.0)


def _alternate(active: _ActivePoints, normal: Array, friction: Array) -> Array:
    """Return forces (k, d) from normal forces (k,) and expected friction (k, d - 1).

    Friction takes accelerated projected-gradient steps (Nesterov); every few of them the normal forces follow.
    """
    slip, limit = active.slip_and_limit(normal)
    current = extrapolated = _project_on_discs(friction.T.ravel(), limit)
    momentum = 1.0
    for step in range(1, _FRICTION_STEPS + 1):
        last = current
        current = _project_on_discs(extrapolated - active.step * (slip + active.tangential @ extrapolated), limit)
        change = current - last
        still = float(np.abs(change).max()) <= _FRICTION_CHANGE * float(limit.max())
        if still or (step % _ALTERNATE_EVERY == 0 and step < _FRICTION_STEPS):
            before, normal = normal, active.normal_forces(current)
            if still and np.linalg.norm(normal - before) <= _NORMAL_CHANGE * np.linalg.norm(before):
                break
            slip, limit = active.slip_and_limit(normal)
        next_momentum = 0.5 + math.sqrt(0.25 + momentum * momentum)
        extrapolated = current + (momentum - 1.0) / next_momentum * change
        momentum = next_momentum
    return np.vstack([normal, _project_on_discs(current, limit).reshape(friction.T.shape)]).T


def _spectral_radius(matrix: Array, rho: Array) -> float:
    """Return an upper estimate of the largest eigenvalue of R^(1/2) W R^(1/2), R = diag(rho), by power iteration."""
    root = np.sqrt(rho)
    vector = root
    for _ in range(3):
        vector = root * (matrix @ (root * vector / np.linalg.norm(vector)))
    return 1.1 * float(np.linalg.norm(vector))


def _project_on_discs(friction: Array, limit: Array) -> Array:
    """Return friction (k (d - 1),) reduced to its limit (k,)."""
    k = len(limit)
    if len(friction) == k:
        return np.minimum(np.maximum(friction, -limit), limit)
    first, second = friction[:k], friction[k:]
    length = np.sqrt(first * first + second * second)
    radial = limit / np.maximum(np.maximum(length, limit), np.finfo(np.float32).tiny)
    return (friction.reshape(2, k) * radial).ravel()
