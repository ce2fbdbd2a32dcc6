"""Semismooth Newton method on the projection equation r = P(r - rho w) (Alart and Curnier 1991).

An iteration determines which points are open, stick or slip (the active set) and solves the linear equations of this
set; it is an active-set strategy with the slip directions linearised.  Projected block Gauss-Seidel is the fallback.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import get_lapack_funcs

from finger3d._types import Array, Float
from finger3d.contact.conditions import ContactProblem, lengths, project_on_friction_cone, residual
from finger3d.contact.friction import SLIP, STICK

Precision: TypeAlias = type[np.float64] | type[np.float32]
Solver: TypeAlias = Callable[[Array], Array]

_CONDITIONS_TOLERANCE = 1e-11
"""Residual of the contact conditions at which an iterate is a solution.  The residual of the projection is not
used: in its friction limit the round-off of a gap is multiplied by mu."""

_JUDGED_BELOW = 1e-6
"""Mismatch over max(1, mu) times the forces, below which the contact conditions are evaluated."""

_STALLED = 1e-3
"""Relative decrease of the residual required of full steps when an active set comes back."""

_ROUND_OFF = 1e-13
"""Residual of the projection that is round-off: over the forces, and as a gap or slip over the length scale."""

_ROWS_IN_CACHE = 64
"""Rows of the Delassus operator gathered at a time, which takes half the time and memory of one gather."""

_DIVERGED = 1e9
"""Forces over those of the start at which Gauss-Seidel has diverged."""


@dataclass(frozen=True)
class NewtonResult:
    """Result of some iterations.

    Attributes
    ----------
    force : (c, d) array, N
    relative_displacement : (c, d) array, mm
    status : (c,) array
        Active set that the forces belong to.
    solved : bool
        Whether they solve the problem.
    iterations : int
        Number of systems of equations that were factored.
    """

    force: Float
    relative_displacement: Float
    status: NDArray[np.int8]
    solved: bool
    iterations: int


class Iterate(NamedTuple):
    """Forces (c, d), their relative displacements (c, d), and their projection on the friction cone.

    `mismatch` is the Euclidean distance between the forces and the projection, N.
    """

    force: Float
    displacement: Float
    projected: Float
    status: NDArray[np.int8]
    augmented_force: Float
    mismatch: float

    @classmethod
    def of(cls, problem: ContactProblem, force: Float) -> Iterate:
        """Return the iterate with these forces."""
        displacement = problem.relative_displacement(force)
        projected, status, augmented = project_on_friction_cone(problem, force, displacement)
        return cls(force, displacement, projected, status, augmented, float(np.linalg.norm(force - projected)))

    def at_roundoff(self, problem: ContactProblem) -> bool:
        """Whether the mismatch is round-off, as a force and as the equivalent gap or slip."""
        lengths_as_forces = problem.length_scale * float(problem.augmentation.min(initial=np.inf))
        return self.mismatch <= _ROUND_OFF * min(float(np.linalg.norm(self.force)), lengths_as_forces)

    def satisfies(self, problem: ContactProblem, status: NDArray[np.int8]) -> bool:
        """Whether the contact conditions hold with this active set."""
        bound = _JUDGED_BELOW * float(problem.friction.max(initial=1.0)) * float(np.linalg.norm(self.force))
        if not self.mismatch <= bound:
            return False
        error = residual(self.force, self.displacement, status, problem.friction, problem.length_scale)
        return error <= _CONDITIONS_TOLERANCE


@dataclass(frozen=True)
class ActiveSet:
    """Active set: the points that stick and slip, and their forces as linear functions r = P x of unknowns x.

    The unknowns are the forces of sticking points, the normal forces x_n of slipping points and, in 3D, their forces
    x_t along the tangent t across the slip direction e.  The equations ask that displacements vanish, weighted to
    forces::

        stick   r = x                     rho w = 0
        slip    r_n = x_n                 rho_n w_n = 0
                r_t = mu e x_n + t x_t    (1 - a) x_t + a rho_t t . w_t = 0,   a = min(mu r_n / |r_t|, 1)

    with r_n, r_t of a taken from the augmented force.  The last row is the derivative of the radial return, as e turns
    with the force.

    Attributes
    ----------
    shape : (c, d)
    active_dofs : (m,) array
        Directions, among c d, of the sticking points and of the slipping points' normals.
    slip_points : (s,) array
    slip_force_direction : (s, d - 1) array
        Friction per normal force, mu e.
    tangent : (s, d - 1) array
        Direction t across the slip; (s, 0) in 2D.
    turning : (s,) array
        Weight a.
    """

    shape: tuple[int, int]
    active_dofs: NDArray[np.int64]
    slip_points: NDArray[np.int64]
    slip_force_direction: Float
    tangent: Float
    turning: Float

    @classmethod
    def of(cls, problem: ContactProblem, status: NDArray[np.int8], augmented_force: Float) -> ActiveSet:
        """Return the active set of a status (c,) whose slip directions are those of the augmented force (c, d)."""
        c, d = augmented_force.shape
        stick, slip = np.flatnonzero(status == STICK), np.flatnonzero(status == SLIP)
        friction_force = augmented_force[slip, 1:]
        length = lengths(friction_force)
        length = np.where(length > 0.0, length, 1.0)
        e = friction_force / length[:, None]
        mu = problem.friction[slip]
        return cls(
            shape=(c, d),
            active_dofs=np.concatenate([(stick[:, None] * d + np.arange(d)).ravel(), slip * d]),
            slip_points=slip,
            slip_force_direction=mu[:, None] * e,
            tangent=np.stack([-e[:, 1], e[:, 0]], axis=1) if d > 2 else np.zeros((len(slip), 0)),
            turning=np.minimum(mu * augmented_force[slip, 0] / length, 1.0),
        )

    @property
    def is_3d(self) -> bool:
        """Whether slip directions can turn."""
        return self.shape[1] > 2

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.active_dofs) + (len(self.slip_points) if self.is_3d else 0)

    @property
    def slip_dofs(self) -> list[NDArray[np.int64]]:
        """Directions, among c d, of the slipping points' tangents: one (s,) array for each tangent."""
        return [self.slip_points * self.shape[1] + i for i in range(1, self.shape[1])]

    def force(self, unknowns: Float) -> Float:
        """Return the forces (c, d), P x, of unknowns (k,)."""
        force = np.zeros(self.shape)
        m, s = len(self.active_dofs), len(self.slip_points)
        force.ravel()[self.active_dofs] = unknowns[:m]
        force[self.slip_points, 1:] = self.slip_force_direction * unknowns[m - s : m, None]
        if self.is_3d:
            force[self.slip_points, 1:] += self.tangent * unknowns[m:, None]
        return force

    def weighted(self, problem: ContactProblem, displacement: Float) -> Float:
        """Return the rows D w (k,), N, of the equations, for displacements (c, d)."""
        w = problem.augmentation * displacement
        rows = w.ravel()[self.active_dofs]
        if not self.is_3d:
            return rows
        return np.concatenate([rows, self.turning * np.sum(self.tangent * w[self.slip_points, 1:], axis=1)])


def submatrix(delassus: Float, dofs: NDArray[np.int64], precision: Precision) -> Array:
    """Return the Delassus operator (k, k) between directions (k,); some rows at a time stay in the cache."""
    matrix = np.empty((len(dofs), len(dofs)), precision)
    for first in range(0, len(dofs), _ROWS_IN_CACHE):
        part = slice(first, first + _ROWS_IN_CACHE)
        matrix[part] = delassus[dofs[part]].take(dofs, axis=1)
    return matrix


def assemble(problem: ContactProblem, active: ActiveSet, precision: Precision) -> Array:
    """Return the matrix A = D W P + diag(0, 0, 1 - a) (k, k) of the equations of an active set.

    The transposed Delassus operator between the points that touch is overwritten: rows are combined to (W P)^T first,
    then columns are weighted, and the transpose is returned.  A definite operator is symmetric.
    """
    slip_dofs = active.slip_dofs
    touched = np.concatenate([active.active_dofs, *slip_dofs])
    transposed = problem.delassus if problem.is_definite else problem.delassus.T
    matrix = submatrix(transposed, touched, precision)
    rho, mu_e, t, a = (  # an operand in double precision would make all of it double
        cast(Float, x.astype(precision, copy=False))
        for x in (problem.augmentation.ravel(), active.slip_force_direction, active.tangent, active.turning)
    )
    m, s = len(active.active_dofs), len(active.slip_points)
    normal, *tangents = (slice(m + i * s, m + (i + 1) * s) for i in range(-1, len(slip_dofs)))
    for i, rows in enumerate(tangents):
        matrix[normal] += mu_e[:, i, None] * matrix[rows]
    matrix[:, :m] *= rho[active.active_dofs]
    if active.is_3d:
        first, second = tangents
        matrix[first] *= t[:, 0, None]
        matrix[first] += t[:, 1, None] * matrix[second]
        matrix[: m + s, first] *= a * t[:, 0] * rho[slip_dofs[0]]
        matrix[: m + s, first] += matrix[: m + s, second] * (a * t[:, 1] * rho[slip_dofs[1]])
        across = np.arange(m, m + s)
        matrix[across, across] += 1.0 - a
    return matrix[: active.size, : active.size].T


@dataclass(frozen=True)
class ActiveSetSystem:
    """Linear equations A x = -D q of an active set, factored; q is the free motion.

    Attributes
    ----------
    active : ActiveSet
    solve : callable
        Unknowns (k,) for a right side (k,).
    rhs : (k,) array, N
    is_exact : bool
        Whether the solution is that of the active set up to round-off: no slip direction turns, no single precision.
    """

    active: ActiveSet
    solve: Solver
    rhs: Float
    is_exact: bool

    @classmethod
    def of(
        cls,
        problem: ContactProblem,
        active: ActiveSet,
        precision: Precision = np.float64,
    ) -> ActiveSetSystem:
        """Assemble and factor the equations of an active set in the given precision."""
        is_exact = not active.is_3d and precision is np.float64
        solve = lu_solver(assemble(problem, active, precision), reuse=not is_exact)
        return cls(active, solve, -active.weighted(problem, problem.free_motion), is_exact)

    def solution(self) -> Float:
        """Return the forces (c, d) that solve the equations."""
        return self.active.force(self.solve(self.rhs) if len(self.rhs) else self.rhs)


def force_of_sets(problem: ContactProblem, status: NDArray[np.int8], augmented_force: Float) -> Float:
    """Return the forces (c, d) that solve the equations of an active set.

    `augmented_force` (c, d) gives the slipping points their direction (see `project_on_friction_cone`).
    """
    return ActiveSetSystem.of(problem, ActiveSet.of(problem, status, augmented_force)).solution()


def lu_solver(matrix: Array, reuse: bool) -> Solver:
    """Return the solution operator of a matrix, factored at once if it is to be reused."""
    if not (reuse and len(matrix)):  # LAPACK accepts no empty matrix
        return partial(np.linalg.solve, matrix)
    getrf, getrs = get_lapack_funcs(("getrf", "getrs"), (matrix,))
    factor, pivots, info = getrf(matrix, overwrite_a=True)
    if info:
        raise np.linalg.LinAlgError("singular")
    return lambda right: np.asarray(getrs(factor, pivots, right)[0])


Correction: TypeAlias = Callable[[ContactProblem, ActiveSetSystem, Iterate], Iterate]


def newton(
    problem: ContactProblem,
    start: Float,
    limit: int,
    damped: bool,
    precision: Precision = np.float64,
    correct: Correction | None = None,
) -> NewtonResult:
    """Solve the projection equation by the semismooth Newton method.

    An active set that comes back with no smaller a mismatch ends the iteration, which would cycle from there.

    Parameters
    ----------
    start : (c, d) array, N
    limit : int
        Largest number of iterations.
    damped : bool
        Whether steps are halved until the mismatch decreases; otherwise they are full.
    precision : float64 or float32
        Precision of the factored matrices.
    correct : callable, optional
        Function that improves an iterate with its factors; see `finger3d.contact.acceleration`.
    """
    current = Iterate.of(problem, start)
    if current.at_roundoff(problem) and current.satisfies(problem, current.status):  # a hold: nothing changes
        return NewtonResult(current.force, current.displacement, current.status, True, 0)
    seen: dict[bytes, float] = {}
    iteration = 0
    for iteration in range(1, limit + 1):
        status = current.status
        required = 1.0 if damped else 1.0 - _STALLED
        if current.mismatch >= required * seen.get(status.tobytes(), np.inf):
            break
        seen[status.tobytes()] = current.mismatch
        try:
            active = ActiveSet.of(problem, status, current.augmented_force)
            system = ActiveSetSystem.of(problem, active, precision)
            target = system.solution()
        except np.linalg.LinAlgError:
            break
        candidate = Iterate.of(problem, target)
        if correct is not None and (candidate.status == status).all():
            candidate = correct(problem, system, candidate)
        if candidate.satisfies(problem, status):
            return NewtonResult(candidate.force, candidate.displacement, status, True, iteration)
        step = 1.0
        while damped and not candidate.mismatch <= (1.0 - 1e-4 * step) * current.mismatch and step >= 1e-3:
            step *= 0.5
            candidate = Iterate.of(problem, current.force + step * (target - current.force))
        if not np.isfinite(candidate.mismatch):
            break
        current = candidate
    return NewtonResult(current.force, current.displacement, current.status, False, iteration)


def block_gauss_seidel(problem: ContactProblem, start: Float, count: int) -> Float:
    """Return the forces (c, d) after `count` projected block Gauss-Seidel sweeps over the points that may touch."""
    c, d = start.shape
    force = start.copy()
    displacement = problem.relative_displacement(force)
    columns = problem.delassus.reshape(c, d, c, d)
    bound = _DIVERGED * (
        float(np.abs(problem.augmentation * problem.free_motion).max(initial=0.0))
        + float(np.abs(start).max(initial=0.0))
    )
    for _ in range(count):
        if not float(np.abs(force).max(initial=0.0)) <= bound:  # the Delassus operator is indefinite
            return start
        for i in np.flatnonzero((force[:, 0] > 0.0) | (displacement[:, 0] < 0.0)):
            augmented = force[i] - problem.augmentation[i] * displacement[i]
            augmented[0] = max(augmented[0], 0.0)
            length = float(np.linalg.norm(augmented[1:]))
            limit = problem.friction[i] * augmented[0]
            if length > limit:
                augmented[1:] *= limit / length
            change = augmented - force[i]
            force[i] = augmented
            displacement += columns[:, :, i] @ change
    return force


def uniqueness(mu: Float, blocks: Float) -> float:
    """Return the largest mu |K_tt^-1 K_tn| over the points, K the inverse of a point's own block (d, d) of W (c, d, d).

    Above 1 there may be several solutions.
    """
    stiff = np.linalg.inv(blocks)
    coupling = np.linalg.solve(stiff[:, 1:, 1:], stiff[:, 1:, :1])[:, :, 0]
    return float(np.max(mu * np.linalg.norm(coupling, axis=1), initial=0.0))
