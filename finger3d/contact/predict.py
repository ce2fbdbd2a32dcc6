"""Where an increment starts: normal forces under the friction expected, then friction under these normal forces.

Alternating between the two problems (Panagiotopoulos 1975) is no solver for large friction; one turn of it costs less
than one Newton iteration of the whole, and leaves it few points that change their state.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.conditions import Increments, lengths

Float = NDArray[np.float64]

_CHANGES = 12
"""Sets of touching points that are tried."""

_STEPS = 6
"""Gradient steps: friction is then as good as the normal forces, which took it as it was, allow."""


def predict(problem: Increments, force: Float) -> Float:
    """Forces (c, d) N to start from, given those expected: these, unless points open or close under them.

    They decide nothing.
    """
    touches = force[:, 0] > problem.rho[:, 0] * problem.moved(force)[:, 0]
    if ((force[:, 0] > 0.0) == touches).all():
        return force
    try:
        normal = _normal(problem, force, touches)
    except np.linalg.LinAlgError:  # of a body that floats, or an indefinite compliance: others judge it
        return force
    found = np.zeros_like(force)
    touching = np.flatnonzero(normal > 0.0)
    if not len(touching):
        return found
    found[touching, 0] = normal[touching]
    found[touching, 1:] = _friction(problem, force, normal, touching)
    return found


def _normal(problem: Increments, force: Float, touches: NDArray[np.bool_]) -> Float:
    """Normal forces (c,) under friction as expected: the active set of a symmetric problem, from points that touch."""
    d = force.shape[1]
    friction = force.copy()
    friction[:, 0] = 0.0
    matrix = np.ascontiguousarray(problem.compliance[::d, ::d])
    open_gap, rho, normal = problem.moved(friction)[:, 0], problem.rho[:, 0], force[:, 0]
    for _ in range(_CHANGES):
        at = np.flatnonzero(touches)
        normal = np.zeros(len(force))
        normal[at] = np.linalg.solve(matrix[np.ix_(at, at)], -open_gap[at])
        last, touches = touches, normal > rho * (open_gap + matrix @ normal)
        if (touches == last).all():
            break
    return np.maximum(normal, 0.0)


def _friction(problem: Increments, force: Float, normal: Float, touching: NDArray[np.int64]) -> Float:
    """Friction (k, d - 1) of touching points under their normal forces (c,): accelerated projected gradients."""
    d = force.shape[1]
    across = (touching[:, None] * d + np.arange(1, d)).ravel()
    matrix = problem.compliance[np.ix_(across, across)]
    alone = np.zeros_like(force)
    alone[:, 0] = normal
    free = problem.moved(alone)[touching, 1:]
    bound, rho = (problem.mu * normal)[touching], problem.rho[touching, 1:]
    step = rho / _largest(matrix, rho)
    last = expected = _cut(force[touching, 1:], bound)
    pace = 1.0
    for _ in range(_STEPS):
        moved = free + (matrix @ expected.ravel()).reshape(free.shape)
        found = _cut(expected - step * moved, bound)
        faster = 0.5 + np.sqrt(0.25 + pace * pace)
        expected = found + (pace - 1.0) / faster * (found - last)
        last, pace = found, faster
    return last


def _largest(matrix: Float, rho: Float) -> float:
    """Largest eigenvalue of a compliance (k, k) weighed by rho: of a motion of all points alike, nearly."""
    root = np.sqrt(rho).ravel()
    vector = root
    for _ in range(3):
        vector = root * (matrix @ (root * vector / np.linalg.norm(vector)))
    return 1.1 * float(np.linalg.norm(vector))


def _cut(friction: Float, bound: Float) -> Float:
    """Friction (k, d - 1) cut back to its bound (k,)."""
    length = lengths(friction)
    return friction * np.where(length > bound, bound / np.where(length > 0.0, length, 1.0), 1.0)[:, None]
