"""Where an increment starts: normal forces under the friction expected, then friction under these, and so on in turn.

Alternating between the two problems (Panagiotopoulos 1975) is no solver for large friction; some turns of it, among the
points that touch, cost less than one Newton iteration of the whole, and leave few of them to it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.conditions import Increments

Float = NDArray[np.float64]

_CHANGES = 12
"""Sets of touching points that are tried."""

_DEEP = 0.6
"""Share of the points found in the object that will touch: 0.5 to 0.67 of those of a cylinder, step by step."""

_TURNS, _SETTLED = 4, 1e-3
"""Turns of the alternation, and the share by which the last one may have changed the forces."""

_STEPS, _STILL = 20, 1e-4
"""Gradient steps in a turn, and the share of the largest friction by which the last one may have changed any."""

_TINY = 1e-300


def predict(problem: Increments, force: Float) -> Float:
    """Forces (c, d) N to start from, given those expected: these, unless points open or close under them.

    They decide nothing.
    """
    gap = problem.moved(force)[:, 0]
    touched, touches = force[:, 0] > 0.0, force[:, 0] > problem.rho[:, 0] * gap
    if (touched == touches).all():
        return force
    found = np.zeros_like(force)
    try:
        normal = found[:, 0] = _normal(problem, force, touches & (touched | _deep(gap, touches & ~touched)))
        touching = np.flatnonzero(normal)
        if len(touching) and force.shape[1] > 1:
            found[touching] = _in_turn(_Touching.of(problem, touching), normal[touching], force[touching, 1:])
    except np.linalg.LinAlgError:  # of a body that floats, or an indefinite compliance: others judge it
        return force
    return found


def _deep(gap: Float, closes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which points (c,) are deep in the object, among those that close: the others open once these are pressed out."""
    return gap <= np.quantile(gap[closes], _DEEP) if closes.any() else closes


def _normal(problem: Increments, force: Float, touches: NDArray[np.bool_]) -> Float:
    """Normal forces (c,) under friction as expected: the active set of a symmetric problem, from points that touch."""
    d = force.shape[1]
    rows = problem.compliance[::d]
    expected = force.copy()
    expected[:, 0] = 0.0
    open_gap = problem.free[:, 0] + rows @ expected.ravel()
    for _ in range(_CHANGES):
        at = np.flatnonzero(touches)
        expected = np.zeros_like(force)
        expected[at, 0] = np.linalg.solve(problem.between(at * d), -open_gap[at])
        gap = open_gap + rows @ expected.ravel()
        last, touches = touches, expected[:, 0] > problem.rho[:, 0] * gap
        if (touches == last).all():
            break
    return np.maximum(expected[:, 0], 0.0)


class _Touching(NamedTuple):
    """What k points do to each other: displacements under no force, and the blocks of their compliance.

    Tangents come direction by direction: `normal` (k, k) is between normals, `tangential` (k (d - 1), k (d - 1))
    between tangents, `coupling` (k, k (d - 1)) between both; `gap` (k,) and `slip` (k (d - 1),) mm are those under no
    force; `step` (k (d - 1),) N/mm is that of a gradient.
    """

    gap: Float
    slip: Float
    normal: Float
    coupling: Float
    tangential: Float
    mu: Float
    step: Float

    @classmethod
    def of(cls, problem: Increments, points: NDArray[np.int64]) -> _Touching:
        d, k = problem.free.shape[1], len(points)
        chosen = (np.arange(d)[:, None] + points * d).ravel()
        whole, free, rho = problem.between(chosen), problem.free.ravel()[chosen], problem.rho.ravel()[chosen[k:]]
        tangential = whole[k:, k:]
        step = rho / _largest(tangential, rho)
        return cls(free[:k], free[k:], whole[:k, :k], whole[:k, k:], tangential, problem.mu[points], step)

    def friction(self, normal: Float, start: Float) -> Float:
        """Friction (k (d - 1),) under normal forces (k,): accelerated projected gradients."""
        slip, bound = self.slip + normal @ self.coupling, self.mu * normal
        last = expected = _cut(start, bound)
        enough = _STILL * float(bound.max())
        pace = 1.0
        for _ in range(_STEPS):
            found = _cut(expected - self.step * (slip + self.tangential @ expected), bound)
            change = found - last
            if float(np.abs(change).max()) <= enough:
                break
            faster = 0.5 + math.sqrt(0.25 + pace * pace)
            expected = found + (pace - 1.0) / faster * change
            last, pace = found, faster
        return found

    def pressed(self, normal: Float, friction: Float) -> Float:
        """Normal forces (k,) under friction (k (d - 1),) of the points that `normal` (k,) presses."""
        at = np.flatnonzero(normal)
        gap = self.gap + self.coupling @ friction
        matrix = self.normal if len(at) == len(normal) else self.normal[np.ix_(at, at)]
        found = np.zeros_like(normal)
        found[at] = np.linalg.solve(matrix, -gap[at])
        return np.maximum(found, 0.0)


def _in_turn(among: _Touching, normal: Float, friction: Float) -> Float:
    """Forces (k, d) from normal forces (k,) and friction (k, d - 1) expected."""
    rubbing = friction.T.ravel()
    for turn in range(_TURNS):
        rubbing = among.friction(normal, rubbing)
        if turn + 1 == _TURNS:
            break
        last, normal = normal, among.pressed(normal, rubbing)
        if np.linalg.norm(normal - last) <= _SETTLED * np.linalg.norm(last):
            break
    rubbing = _cut(rubbing, among.mu * normal)
    return np.vstack([normal, rubbing.reshape(friction.T.shape)]).T


def _largest(matrix: Float, rho: Float) -> float:
    """Largest eigenvalue of a compliance (k, k) weighed by rho: of a motion of all points alike, nearly."""
    root = np.sqrt(rho)
    vector = root
    for _ in range(3):
        vector = root * (matrix @ (root * vector / np.linalg.norm(vector)))
    return 1.1 * float(np.linalg.norm(vector))


def _cut(friction: Float, bound: Float) -> Float:
    """Friction (k (d - 1),) cut back to its bound (k,)."""
    k = len(bound)
    if len(friction) == k:
        return np.minimum(np.maximum(friction, -bound), bound)
    length = np.hypot(friction[:k], friction[k:])
    share = np.where(length > bound, bound / np.maximum(length, _TINY), 1.0)
    return (friction.reshape(2, k) * share).ravel()
