"""The contact conditions, once for every dimension: as a projection to solve with, and as inequalities to check.

Maeno 2004, Eqs. (1)-(4): a point is open (gap > 0, no force), or touches (gap 0, f_n > 0) and then sticks
(no change of position, |f_t| < mu f_n) or slips (|f_t| = mu f_n); and friction opposes slip, which the paper leaves
out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.friction import OPEN, SLIP, STICK

Float = NDArray[np.float64]

TOLERANCE = 1e-8
"""Largest residual at which a step may call itself converged."""

_CACHED = 30_000
"""Numbers that are gathered at once."""


PRECISION: dict[int, type[Any]] = {1: np.float64, 2: np.float64, 3: np.float32}
"""Precision of starts and of Newton's first factors, by dimension: matrices of 2D fit into the cache in double too."""


@dataclass(frozen=True)
class ContactProblem:
    """One increment to be solved: find force (c, d) such that ``moved = free + C force`` meets the conditions.

    Attributes
    ----------
    free_motion : (c, d) mm
        Gap and change of tangential position of each point under no contact force.
    delassus : (c d, c d) mm/N
    friction : (c,)
    augmentation : (c, d) N/mm
        Stiffness that weighs a violated gap or slip against a force: 1 / diagonal of the compliance, tangents alike.
    length_scale : mm
        What a violated gap or slip is measured by.
    """

    free_motion: Float
    delassus: Float
    friction: Float
    augmentation: Float
    length_scale: float

    def relative_displacement(self, force: Float) -> Float:
        """Gap and change of position (c, d) mm under forces (c, d) N."""
        return self.free_motion + self._times(self.delassus, force).reshape(force.shape)

    def gap(self, force: Float) -> Float:
        """Gap (c,) mm under forces (c, d) N."""
        return self.free_motion[:, 0] + self._times(self.delassus[:: force.shape[1]], force)

    @staticmethod
    def _times(rows: Float, force: Float) -> Float:
        """Rows (k, c d) times forces (c, d), up to the last point that bears one: those pressed deepest come first."""
        forces = force.ravel()
        last = np.flatnonzero(forces)[-1:] + 1
        reach = int(last[0]) if len(last) else 0
        return rows[:, :reach] @ forces[:reach]

    def between(self, chosen: NDArray[np.int64], precision: type[Any] = np.float64) -> NDArray[Any]:
        """Compliance (k, k) between the chosen ones of c d forces, gathered within what a cache holds."""
        found: NDArray[Any] = np.empty((len(chosen), len(chosen)), dtype=precision)
        reach = int(chosen.max(initial=-1)) + 1
        stride = max(1, _CACHED // max(1, reach))
        for i in range(0, len(chosen), stride):
            part = slice(i, i + stride)
            rows: NDArray[Any] = self.delassus[chosen[part], :reach].astype(precision, copy=False)
            np.take(rows, chosen, axis=1, out=found[part], mode="clip")  # "raise" would copy
        return found


def lengths(vectors: Float) -> Float:
    """Lengths (c,) of vectors (c, k); numpy's norm takes several times as long on short ones."""
    return np.abs(vectors[:, 0]) if vectors.shape[1] == 1 else np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def augmentation_parameters(compliance: Float, dim: int) -> Float:
    """Weights rho (c, d) N/mm from the diagonal of a compliance (c d, c d); the tangents of a point share the least."""
    rho = 1.0 / np.diagonal(compliance).reshape(-1, dim)
    rho = rho.copy()
    rho[:, 1:] = rho[:, 1:].min(axis=1, keepdims=True, initial=np.inf)
    return rho


def project_on_friction_cone(
    problem: ContactProblem, force: Float, moved: Float
) -> tuple[Float, NDArray[np.int8], Float]:
    """Projection of ``force - rho moved`` on the friction cone of its own normal force.

    Returns
    -------
    projected : (c, d) N
    status : (c,) read off the projection
    trial : (c, d) N, normal force cut at 0, tangential force before it is cut back to length mu n
    """
    trial = force - problem.augmentation * moved
    trial[:, 0] = np.maximum(trial[:, 0], 0.0)
    normal = trial[:, 0]
    length = lengths(trial[:, 1:])
    bound = problem.friction * normal
    slips = (length > bound) | (problem.friction == 0.0)
    cut = np.where(slips, bound / np.where(length > 0.0, length, 1.0), 1.0)
    projected = trial.copy()
    projected[:, 1:] *= cut[:, None]
    status = np.where(normal <= 0.0, OPEN, np.where(slips, SLIP, STICK)).astype(np.int8)
    return projected, status, trial


def residual(force: Float, moved: Float, status: NDArray[np.int8], mu: Float, length_scale: float) -> float:
    """Largest violation of the conditions: lengths by `length_scale` (mm), forces by the largest nodal force.

    Parameters
    ----------
    force, moved : (c, d) N and mm, as in `ContactProblem`
    status : (c,)
    mu : (c,) coefficient that limits each point
    """
    if not len(force):
        return 0.0
    if not np.isfinite(force).all():
        return float("inf")
    force_scale = float(lengths(force).max()) or 1.0
    normal, friction = force[:, 0], force[:, 1:]
    gap, slip = moved[:, 0], moved[:, 1:]
    length = lengths(friction)
    opened, stuck, slips = status == OPEN, status == STICK, status == SLIP
    against = friction / np.where(length > 0.0, length, 1.0)[:, None]
    backward = np.maximum(-np.sum(slip * against, axis=1), 0.0)
    astray = lengths(slip + backward[:, None] * against)
    violated = [
        np.where(opened, np.maximum(-gap, 0.0), np.abs(gap)),
        np.where(stuck, lengths(slip), 0.0),
        np.where(slips & (length > 0.0), astray, 0.0),
    ]
    forces = [
        np.where(opened, np.abs(normal) + length, np.maximum(-normal, 0.0)),
        np.where(stuck, np.maximum(length - mu * normal, 0.0), 0.0),
        np.where(slips, np.abs(length - mu * normal), 0.0),
    ]
    return float(max(np.max(violated) / length_scale, np.max(forces) / force_scale))
