"""Semismooth Newton on the projection, and block Gauss-Seidel sweeps: the two engines of `advance`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.conditions import Increments, project, residual
from finger3d.contact.law import SLIP, STICK

Float = NDArray[np.float64]

_EXACT = 1e-11
"""Residual of the conditions themselves at which an iterate is a solution; the projection's own residual would not do,
since a gap's round-off enters its bound times mu."""

_NEAR = 1e-6
"""Residual of the projection, as a share of the forces and times mu, below which the conditions are judged."""

_STALLED = 1e-3
"""Share by which the residual must have fallen where full steps come back to a set of states."""

_DIVERGED = 1e9

_CACHED = 30_000
"""Numbers that are gathered at once."""


@dataclass(frozen=True)
class Iterate:
    """Forces (c, d) N after some iterations with the sets (c,) they belong to, and whether they are a solution."""

    force: Float
    status: NDArray[np.int8]
    solved: bool
    iterations: int


def force_of_sets(problem: Increments, status: NDArray[np.int8], trial: Float) -> Float:
    """Forces (c, d) that solve the equations of the sets, slip rows with the normal force unknown.

    `trial` (c, d) gives slipping points their direction e, and how firmly it is held (see `project`).  A sticking
    point has d unknowns; a slipping one its f_n, with f_t = mu f_n e, and in 3D the force across e, which follows the
    slip's turning (the derivative of the projection).
    """
    c, d = trial.shape
    slip, stick = np.flatnonzero(status == SLIP), np.flatnonzero(status == STICK)
    k, n = len(slip), len(stick) * d
    if not n + k:
        return np.zeros((c, d))
    tangent = trial[slip, 1:]
    length = np.linalg.norm(tangent, axis=1)
    length = np.where(length > 0.0, length, 1.0)
    direction = tangent / length[:, None]
    mu = problem.mu[slip]
    pull = mu[:, None] * direction
    # unknowns: forces of sticking points, f_n of slipping ones, force across; equations: which displacement vanishes,
    # weighted to a force.  All is made in place of the compliance between points that touch, whose slipping ones come
    # direction by direction: passes over it are as dear as the solution.
    own = np.concatenate([(stick[:, None] * d + np.arange(d)).ravel(), slip * d])
    sides = [slip * d + i for i in range(1, d)]
    whole = _between(problem.compliance, np.concatenate([own, *sides]))
    rho, free = problem.rho.ravel(), problem.free.ravel()
    normal, first, second = (slice(n + i * k, n + (i + 1) * k) for i in range(3))
    for i, side in enumerate((first, second)[: d - 1]):
        whole[normal] += pull[:, i, None] * whole[side]  # displacements per unit of f_n; the compliance is symmetric
    right = rho[own] * free[own]
    whole[:, : n + k] *= rho[own]  # equations run along its columns
    count = n + k
    if d > 2:
        count += k
        turn = np.minimum(mu * trial[slip, 0] / length, 1.0)
        across = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
        whole[first] *= across[:, 0, None]
        whole[first] += across[:, 1, None] * whole[second]
        weigh = [turn * across[:, i] * rho[side] for i, side in enumerate(sides)]
        whole[:count, first] *= weigh[0]
        whole[:count, first] += whole[:count, second] * weigh[1]
        right = np.concatenate([right, weigh[0] * free[sides[0]] + weigh[1] * free[sides[1]]])
        at = np.arange(n + k, count)
        whole[at, at] += 1.0 - turn
    unknowns = np.linalg.solve(whole[:count, :count].T, -right)
    force = np.zeros((c, d))
    force.ravel()[own] = unknowns[: n + k]
    force[slip, 1:] = pull * unknowns[normal, None]
    if d > 2:
        force[slip, 1:] += across * unknowns[first, None]
    return force


def _between(matrix: Float, chosen: NDArray[np.int64]) -> Float:
    """Entries of a matrix between the chosen rows and columns, row by row within what a cache holds."""
    count = len(chosen)
    found = np.empty((count, count))
    stride = max(1, _CACHED // len(matrix))
    for i in range(0, count, stride):
        part = slice(i, i + stride)
        np.take(matrix.take(chosen[part], axis=0), chosen, axis=1, out=found[part], mode="clip")  # "raise" would copy
    return found


def newton(problem: Increments, start: Float, limit: int, damped: bool) -> Iterate:
    """Semismooth Newton from forces `start` (c, d) N; full steps, or with a backtracking search on the residual force.

    A set of states that comes back with no smaller a residual ends it: it would cycle from there.
    """
    force, near = start, _NEAR * float(problem.mu.max(initial=1.0))
    projected, status, trial = project(problem, force, problem.moved(force))
    merit = float(np.linalg.norm(force - projected))
    seen: dict[bytes, float] = {}
    iteration = 0
    for iteration in range(1, limit + 1):
        if merit >= (1.0 if damped else 1.0 - _STALLED) * seen.get(status.tobytes(), np.inf):
            break
        seen[status.tobytes()] = merit
        try:
            target = force_of_sets(problem, status, trial)
        except np.linalg.LinAlgError:
            break
        share, candidate, moved = 1.0, target, problem.moved(target)
        while True:
            projected, next_status, next_trial = project(problem, candidate, moved)
            next_merit = float(np.linalg.norm(candidate - projected))
            if share == 1.0 and next_merit <= near * float(np.linalg.norm(target)):
                if residual(target, moved, status, problem.mu, problem.length_scale) <= _EXACT:
                    return Iterate(target, status, True, iteration)
            if not damped or next_merit <= (1.0 - 1e-4 * share) * merit or share < 1e-3:
                break
            share *= 0.5
            candidate = force + share * (target - force)
            moved = problem.moved(candidate)
        if not np.isfinite(next_merit):
            break
        force, status, trial, merit = candidate, next_status, next_trial, next_merit
    return Iterate(force, status, False, iteration)


def sweeps(problem: Increments, start: Float, count: int) -> Float:
    """Forces (c, d) after `count` projected block Gauss-Seidel sweeps over the points that may touch."""
    c, d = start.shape
    force = start.copy()
    moved = problem.moved(force)
    columns = problem.compliance.reshape(c, d, c, d)
    far = _DIVERGED * (
        float(np.abs(problem.rho * problem.free).max(initial=0.0)) + float(np.abs(start).max(initial=0.0))
    )
    for _ in range(count):
        if not float(np.abs(force).max(initial=0.0)) <= far:  # the compliance has a direction that is not held
            return start
        for i in np.flatnonzero((force[:, 0] > 0.0) | (moved[:, 0] < 0.0)):
            trial = force[i] - problem.rho[i] * moved[i]
            trial[0] = max(trial[0], 0.0)
            length = float(np.linalg.norm(trial[1:]))
            bound = problem.mu[i] * trial[0]
            if length > bound:
                trial[1:] *= bound / length
            change = trial - force[i]
            force[i] = trial
            moved += columns[:, :, i] @ change
    return force


def uniqueness(problem_mu: Float, compliance: Float, dim: int) -> float:
    """Largest mu |K_tt^-1 K_tn| over points, K the inverse of a point's own block; above 1 answers may be several."""
    c = len(problem_mu)
    blocks = compliance.reshape(c, dim, c, dim)[np.arange(c), :, np.arange(c)]
    stiff = np.linalg.inv(blocks)
    coupling = np.linalg.solve(stiff[:, 1:, 1:], stiff[:, 1:, :1])[:, :, 0]
    return float(np.max(problem_mu * np.linalg.norm(coupling, axis=1), initial=0.0))
