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

_DIVERGED = 1e9


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
    if not len(slip) + len(stick):
        return np.zeros((c, d))
    tangent = trial[slip, 1:]
    length = np.linalg.norm(tangent, axis=1)
    length = np.where(length > 0.0, length, 1.0)
    direction = tangent / length[:, None]
    mu = problem.mu[slip]
    turn = np.minimum(mu * trial[slip, 0] / length, 1.0) if d > 2 else np.zeros(0)
    across = np.stack([-direction[:, 1], direction[:, 0]], axis=1) if d > 2 else np.zeros((0, 0))
    # unknowns: forces of sticking points, f_n of slipping ones, force across; equations: which displacement vanishes,
    # weighted to a force.  Rows of the compliance are taken whole: gathering is as dear as the solution.
    n, k, w = len(stick) * d, len(slip), len(turn)
    normal, rho, compliance = slip * d, problem.rho.ravel(), problem.compliance
    free_dofs, side = (stick[:, None] * d + np.arange(d)).ravel(), [normal + i for i in range(1, d)]
    own = np.concatenate([free_dofs, normal])
    pull = mu[:, None] * direction
    sides = [compliance.take(s, axis=0) for s in side]
    moved = np.empty((n + k + w, c * d))  # displacements per unit of every unknown; the compliance is symmetric
    moved[: n + k] = compliance.take(own, axis=0)
    for i, rows in enumerate(sides):
        moved[n : n + k] += pull[:, i, None] * rows
        if w:
            moved[n + k :] = across[:, i, None] * rows + (moved[n + k :] if i else 0.0)
    turned = np.empty((n + k + w, n + k + w))  # equations run along its columns
    np.multiply(moved.take(own, axis=1), rho[own], out=turned[:, : n + k])
    right = np.empty(n + k + w)
    free = problem.free.ravel()
    right[: n + k] = rho[own] * free[own]
    if w:
        weigh = [turn * across[:, i] * rho[s] for i, s in enumerate(side)]
        turned[:, n + k :] = sum(moved.take(s, axis=1) * weigh[i] for i, s in enumerate(side))
        right[n + k :] = sum(weigh[i] * free[s] for i, s in enumerate(side))
    at_w = n + k + np.arange(w)
    turned[at_w, at_w] += 1.0 - turn
    unknowns = np.linalg.solve(turned.T, -right)
    force = np.zeros((c, d))
    force.ravel()[free_dofs] = unknowns[:n]
    force[slip, 0] = unknowns[n : n + k]
    force[slip, 1:] = pull * unknowns[n : n + k, None]
    if w:
        force[slip, 1:] += across * unknowns[n + k :, None]
    return force


def newton(problem: Increments, start: Float, limit: int, damped: bool) -> Iterate:
    """Semismooth Newton from forces `start` (c, d) N; full steps, or with a backtracking search on the residual force.

    A set of states that comes back with the same residual ends the full-step variant: it would cycle from there.
    """
    force, near = start, _NEAR * float(problem.mu.max(initial=1.0))
    projected, status, trial = project(problem, force, problem.moved(force))
    merit = float(np.linalg.norm(force - projected))
    seen: dict[bytes, float] = {}
    iteration = 0
    for iteration in range(1, limit + 1):
        if seen.get(status.tobytes()) == merit:
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
