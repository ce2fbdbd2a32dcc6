"""Semismooth Newton on the projection, and block Gauss-Seidel sweeps: the two engines of `advance`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.conditions import PRECISION, ContactProblem, lengths, project_on_friction_cone, residual
from finger3d.contact.friction import SLIP, STICK

Float = NDArray[np.float64]

_EXACT = 1e-11
"""Residual of the conditions themselves at which an iterate is a solution; the projection's own residual would not do,
since a gap's round-off enters its bound times mu."""

_NEAR = 1e-6
"""Residual of the projection, as a share of the forces, and times a mu above 1, below which the conditions are
judged."""

_STALLED = 1e-3
"""Share by which the residual must have fallen where full steps come back to a set of states."""

_DIVERGED = 1e9

_SINGLE, _RUBBER = 4, 2.0
"""Iterations of `mixed_precision_newton` in single precision, and the largest mu for it: at mu = 10 it often wants
digits.
"""

_CORRECTIONS, _PAYS = 12, 0.1
"""Corrections with one factor, and the share of the residual that one may leave: it costs a tenth of an iteration."""

_FINE = 1e-13
"""Share of the forces that corrections leave: they come down by steps, where Newton's last iteration reaches
round-off."""


@dataclass(frozen=True)
class Iterate:
    """Forces (c, d) N after some iterations, where they move the points (c, d) mm, the sets (c,) they belong to.

    `solved` says whether they are a solution.  An iteration is a system of equations set up and factored; corrections
    with its factor are part of it.
    """

    force: Float
    relative_displacement: Float
    status: NDArray[np.int8]
    solved: bool
    iterations: int


def force_of_sets(problem: ContactProblem, status: NDArray[np.int8], trial: Float) -> Float:
    """Forces (c, d) that solve the equations of the sets, slip rows with the normal force unknown.

    `trial` (c, d) gives slipping points their direction e, and how firmly it is held (see `project_on_friction_cone`).
    A sticking point has d unknowns; a slipping one its f_n, with f_t = mu f_n e, and in 3D the force across e, which
    follows the slip's turning (the derivative of the projection).
    """
    return _System.of(problem, status, trial).solution()


@dataclass(frozen=True)
class _System:
    """The equations of the sets, factored.

    Attributes
    ----------
    solve : right side (k,) -> unknowns (k,): forces of `own`, then those across the slip of `slip`
    right : (k,)
    own : numbers among c d of the sticking points' directions, then of the slipping ones' normals
    slip : (s,) points
    pull : (s, d - 1) friction per normal force
    across : (s, d - 1) direction across the slip; in 2D there is none
    exact : whether its solution is that of the sets: no slip direction turns, and no digit is left out
    """

    shape: tuple[int, ...]
    solve: Callable[[Float], Float]
    right: Float
    own: NDArray[np.int64]
    slip: NDArray[np.int64]
    pull: Float
    across: Float
    exact: bool

    @classmethod
    def of(
        cls, problem: ContactProblem, status: NDArray[np.int8], trial: Float, precision: type[Any] = np.float64
    ) -> _System:
        """The equations of the sets of `force_of_sets`."""
        c, d = trial.shape
        slip, stick = np.flatnonzero(status == SLIP), np.flatnonzero(status == STICK)
        k, n = len(slip), len(stick) * d
        tangent = trial[slip, 1:]
        length = lengths(tangent)
        length = np.where(length > 0.0, length, 1.0)
        direction = tangent / length[:, None]
        across = np.stack([-direction[:, 1], direction[:, 0]], axis=1) if d > 2 else direction
        mu = problem.friction[slip]
        pull = mu[:, None] * direction
        # unknowns: forces of sticking points, f_n of slipping ones, force across; equations: which displacement
        # vanishes, weighted to a force.  All is made in place of the compliance between points that touch, whose
        # slipping ones come direction by direction: passes over it are as dear as the solution.
        own = np.concatenate([(stick[:, None] * d + np.arange(d)).ravel(), slip * d])
        sides = [slip * d + i for i in range(1, d)]
        whole = problem.between(np.concatenate([own, *sides]), precision)
        free, kind = problem.free_motion.ravel(), whole.dtype  # one operand in double would make all of it so
        rho, pulls, sideways = (a.astype(kind, copy=False) for a in (problem.augmentation.ravel(), pull, across))
        normal, first, second = (slice(n + i * k, n + (i + 1) * k) for i in range(3))
        for i, side in enumerate((first, second)[: d - 1]):
            whole[normal] += pulls[:, i, None] * whole[side]  # displacements per unit of f_n; compliance is symmetric
        right = rho[own] * free[own]
        whole[:, : n + k] *= rho[own]  # equations run along its columns
        count = n + k
        if d > 2:
            count += k
            turn = np.minimum(mu * trial[slip, 0] / length, 1.0).astype(kind, copy=False)
            whole[first] *= sideways[:, 0, None]
            whole[first] += sideways[:, 1, None] * whole[second]
            weigh = [turn * sideways[:, i] * rho[side] for i, side in enumerate(sides)]
            whole[:count, first] *= weigh[0]
            whole[:count, first] += whole[:count, second] * weigh[1]
            right = np.concatenate([right, weigh[0] * free[sides[0]] + weigh[1] * free[sides[1]]])
            at = np.arange(n + k, count)
            whole[at, at] += 1.0 - turn
        exact = count == n + k and precision is np.float64
        return cls((c, d), lu_solver(whole[:count, :count].T, not exact), -right, own, slip, pull, across, exact)

    def solution(self) -> Float:
        """Forces (c, d) that meet the equations."""
        return self._forces(self.solve(self.right)) if len(self.right) else np.zeros(self.shape)

    def corrected(self, force: Float, mismatch: Float) -> Float:
        """Forces (c, d) nearer to a solution with the same sets, from their mismatch (c, d) with the projection.

        Simplified Newton: the factor is that of slip directions which have turned a little since, or wants digits.
        `force` must be `rubbing`, for the equations know nothing of friction that is longer than mu f_n.
        """
        across = np.sum(mismatch[self.slip, 1:] * self.across, axis=1)
        change = self.solve(-np.concatenate([mismatch.ravel()[self.own], across]))
        return self.rubbing(force + self._forces(change))

    def rubbing(self, force: Float) -> Float:
        """Forces (c, d) with friction mu f_n at slipping points, wherever it points."""
        found = force.copy()
        length = lengths(found[self.slip, 1:])
        size = lengths(self.pull) * found[self.slip, 0]
        found[self.slip, 1:] *= (size / np.where(length > 0.0, length, 1.0))[:, None]
        return found

    def _forces(self, unknowns: Float) -> Float:
        force = np.zeros(self.shape)
        own, slipping = len(self.own), len(self.slip)
        force.ravel()[self.own] = unknowns[:own]
        force[self.slip, 1:] = self.pull * unknowns[own - slipping : own, None]
        if len(unknowns) > own:
            force[self.slip, 1:] += self.across * unknowns[own:, None]
        return force


def lu_solver(matrix: NDArray[Any], again: bool) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """What solves with a matrix; factored at once if it will be asked again."""
    if not (again and len(matrix)):  # LAPACK takes no empty ones
        return partial(np.linalg.solve, matrix)
    from scipy.linalg.lapack import get_lapack_funcs  # not at the top: 2D never asks again, and need not load it

    getrf, getrs = get_lapack_funcs(("getrf", "getrs"), (matrix,))
    factor, pivots, trouble = getrf(matrix, overwrite_a=True)
    if trouble:
        raise np.linalg.LinAlgError("singular")
    return lambda right: np.asarray(getrs(factor, pivots, right)[0])


class _Tried(NamedTuple):
    """Forces (c, d) N, where they move the points (c, d) mm, and their projection: forces, states, trial forces.

    `merit` is how far they are from it, N.
    """

    force: Float
    moved: Float
    projected: Float
    status: NDArray[np.int8]
    trial: Float
    merit: float

    @classmethod
    def of(cls, problem: ContactProblem, force: Float) -> _Tried:
        moved = problem.relative_displacement(force)
        projected, status, trial = project_on_friction_cone(problem, force, moved)
        return cls(force, moved, projected, status, trial, float(np.linalg.norm(force - projected)))

    def fine(self, problem: ContactProblem) -> bool:
        """Whether nothing is left to correct, neither of the forces nor of the gaps that violate them."""
        gaps = _EXACT * problem.length_scale * float(problem.augmentation.min(initial=np.inf))
        return self.merit <= min(_FINE * float(np.linalg.norm(self.force)), gaps)

    def solves(self, problem: ContactProblem, status: NDArray[np.int8]) -> bool:
        """Whether the conditions hold with these states."""
        near = _NEAR * float(problem.friction.max(initial=1.0)) * float(np.linalg.norm(self.force))
        if not self.merit <= near:
            return False
        return residual(self.force, self.moved, status, problem.friction, problem.length_scale) <= _EXACT


def mixed_precision_newton(problem: ContactProblem, start: Float, limit: int, damped: bool) -> Iterate:
    """`newton`, in 3D and under moderate friction in single precision first, and if that settles nothing in double.

    Corrections bring the digits that a factor in single precision leaves out, and cost less than it saves.
    """
    precision = PRECISION[start.shape[1]]
    if precision is np.float64 or problem.friction.max(initial=0.0) > _RUBBER:
        return newton(problem, start, limit, damped)
    single = newton(problem, start, _SINGLE, damped, precision)
    if single.solved:
        return single
    double = newton(problem, start, limit, damped)
    return replace(double, iterations=single.iterations + double.iterations)


def newton(
    problem: ContactProblem, start: Float, limit: int, damped: bool, precision: type[Any] = np.float64
) -> Iterate:
    """Semismooth Newton from forces `start` (c, d) N; full steps, or with a backtracking search on the residual force.

    A set of states that comes back with no smaller a residual ends it: it would cycle from there.  `precision` is that
    of the factors.
    """
    here = _Tried.of(problem, start)
    seen: dict[bytes, float] = {}
    iteration = 0
    for iteration in range(1, limit + 1):
        status = here.status
        if here.merit >= (1.0 if damped else 1.0 - _STALLED) * seen.get(status.tobytes(), np.inf):
            break
        seen[status.tobytes()] = here.merit
        try:
            system = _System.of(problem, status, here.trial, precision)
            target = system.solution()
        except np.linalg.LinAlgError:
            break
        share, there = 1.0, _Tried.of(problem, target)
        if not (there.fine(problem) or system.exact) and (there.status == status).all():
            there = _turned(problem, system, there)
        if there.solves(problem, status):
            return Iterate(there.force, there.moved, status, True, iteration)
        while damped and not there.merit <= (1.0 - 1e-4 * share) * here.merit and share >= 1e-3:
            share *= 0.5
            there = _Tried.of(problem, here.force + share * (target - here.force))
        if not np.isfinite(there.merit):
            break
        here = there
    return Iterate(here.force, here.moved, here.status, False, iteration)


def _turned(problem: ContactProblem, system: _System, found: _Tried) -> _Tried:
    """What corrections with the factor at hand make of forces whose sets are those of the system, while they pay."""
    best = _Tried.of(problem, system.rubbing(found.force))
    for _ in range(_CORRECTIONS):
        if best.fine(problem) or (best.status != found.status).any():
            break
        tried = _Tried.of(problem, system.corrected(best.force, best.force - best.projected))
        if not tried.merit <= _PAYS * best.merit:
            break
        best = tried
    return min(found, best, key=lambda t: t.merit)


def block_gauss_seidel(problem: ContactProblem, start: Float, count: int) -> Float:
    """Forces (c, d) after `count` projected block Gauss-Seidel sweeps over the points that may touch."""
    c, d = start.shape
    force = start.copy()
    moved = problem.relative_displacement(force)
    columns = problem.delassus.reshape(c, d, c, d)
    far = _DIVERGED * (
        float(np.abs(problem.augmentation * problem.free_motion).max(initial=0.0))
        + float(np.abs(start).max(initial=0.0))
    )
    for _ in range(count):
        if not float(np.abs(force).max(initial=0.0)) <= far:  # the compliance has a direction that is not held
            return start
        for i in np.flatnonzero((force[:, 0] > 0.0) | (moved[:, 0] < 0.0)):
            trial = force[i] - problem.augmentation[i] * moved[i]
            trial[0] = max(trial[0], 0.0)
            length = float(np.linalg.norm(trial[1:]))
            bound = problem.friction[i] * trial[0]
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
