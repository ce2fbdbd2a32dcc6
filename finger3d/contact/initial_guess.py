"""Where an increment starts: normal forces under the friction expected, then friction under these, and so on in turn.

Alternating between the two problems (Panagiotopoulos 1975) is no solver for large friction; some turns of it, among the
points that touch, cost less than one Newton iteration of the whole, and leave few of them to it.  No turn is carried to
its end: friction is on its way, by gradient steps, while the normal forces follow.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.conditions import PRECISION, ContactProblem, project_on_friction_cone
from finger3d.contact.newton import lu_solver

Float = NDArray[np.float64]

_CHANGES = 12
"""Sets of touching points that are tried."""

_DEEP = 0.6
"""Share of the points found in the object that will touch: 0.5 to 0.67 of those of a cylinder, step by step."""

_STEPS, _TURN = 40, 8
"""Gradient steps at most, and after how many of them the normal forces follow the friction."""

_STILL, _SETTLED = 1e-4, 1e-3
"""Shares of the largest friction and of the normal forces by which the last step and the last turn may change them."""

_FITS = 1e-2
"""Share of the forces by which those expected may miss their projection, and be the start: Newton is done soon then."""

_TINY = 1e-30

Array = NDArray[np.floating[Any]]
Solve = Callable[[Array], Array]


def initial_guess(problem: ContactProblem, force: Float) -> Float:
    """Forces (c, d) N to start from, given those expected: these, if hardly anything would change under them.

    They decide nothing.
    """
    gap = problem.gap(force)
    touched, touches = force[:, 0] > 0.0, force[:, 0] > problem.augmentation[:, 0] * gap
    if (touched == touches).all() and _fits(problem, force):
        return force
    found = np.zeros_like(force)
    try:
        at, normal, press = _normal(problem, force, touches & (touched | _deep(gap, touches & ~touched)))
        if len(at) and force.shape[1] > 1:
            found[at] = _in_turn(_Touching.of(problem, at, press), normal, force[at, 1:].astype(normal.dtype))
        else:
            found[at, 0] = normal
    except np.linalg.LinAlgError:  # of a body that floats, or an indefinite compliance: others judge it
        return force
    return found


def _fits(problem: ContactProblem, force: Float) -> bool:
    """Whether forces (c, d) nearly are their own projection."""
    missed = force - project_on_friction_cone(problem, force, problem.relative_displacement(force))[0]
    return float(np.linalg.norm(missed)) <= _FITS * float(np.linalg.norm(force))


def _deep(gap: Float, closes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which points (c,) are deep in the object, among those that close: the others open once these are pressed out."""
    return gap <= np.quantile(gap[closes], _DEEP) if closes.any() else closes


def _normal(problem: ContactProblem, force: Float, touches: NDArray[np.bool_]) -> tuple[NDArray[np.intp], Array, Solve]:
    """Normal forces under friction as expected: the active set of a symmetric problem, from points that touch.

    Returns
    -------
    at : (k,) points that touch
    normal : (k,) N
    press : gaps (k,) that are to be closed -> normal forces (k,)
    """
    d = force.shape[1]
    precision = PRECISION[d]
    expected = force.copy()
    expected[:, 0] = 0.0
    open_gap = problem.gap(expected)
    for _ in range(_CHANGES):
        at = np.flatnonzero(touches)
        press: Solve = lu_solver(problem.between(at * d, precision), d > 2)
        expected[:] = 0.0
        expected[at, 0] = normal = press(-open_gap[at].astype(precision))
        gap = open_gap + problem.gap(expected) - problem.free_motion[:, 0]
        last, touches = touches, expected[:, 0] > problem.augmentation[:, 0] * gap
        if (touches == last).all():
            break
    return at, np.maximum(normal, 0.0), press


class _Touching(NamedTuple):
    """What k points do to each other: displacements under no force, and the blocks of their compliance.

    Tangents come direction by direction: `coupling` (k, k (d - 1)) is between normals and them, `tangential`
    (k (d - 1), k (d - 1)) between themselves; `gap` (k,) and `slip` (k (d - 1),) mm are those under no force; `press`
    makes normal forces (k,) of gaps (k,); `step` (k (d - 1),) N/mm is that of a gradient.
    """

    gap: Array
    slip: Array
    press: Solve
    coupling: Array
    tangential: Array
    mu: Array
    step: Array

    @classmethod
    def of(cls, problem: ContactProblem, points: NDArray[np.int64], press: Solve) -> _Touching:
        d, k = problem.free_motion.shape[1], len(points)
        chosen = (np.arange(d)[:, None] + points * d).ravel()
        whole = problem.between(chosen, PRECISION[d])
        free, rho = (a.ravel()[chosen].astype(whole.dtype) for a in (problem.free_motion, problem.augmentation))
        coupling, tangential, rho = whole[:k, k:], whole[k:, k:], rho[k:]
        mu, step = problem.friction[points].astype(whole.dtype), rho / _largest(tangential, rho)
        return cls(free[:k], free[k:], press, coupling, tangential, mu, step)

    def under(self, normal: Array) -> tuple[Array, Array]:
        """Slip (k (d - 1),) mm under no friction, and bound (k,) N of it, where normal forces (k,) press."""
        return self.slip + normal @ self.coupling, self.mu * normal

    def pressed(self, friction: Array) -> Array:
        """Normal forces (k,) under friction (k (d - 1),)."""
        return np.maximum(self.press(-(self.gap + self.coupling @ friction)), 0.0)


def _in_turn(among: _Touching, normal: Array, friction: Array) -> Array:
    """Forces (k, d) from normal forces (k,) and friction (k, d - 1) expected.

    Friction takes accelerated projected gradient steps, and every few of them the normal forces follow it.
    """
    slip, bound = among.under(normal)
    rubbing = expected = _cut(friction.T.ravel(), bound)
    pace = 1.0
    for step in range(1, _STEPS + 1):
        last, rubbing = rubbing, _cut(expected - among.step * (slip + among.tangential @ expected), bound)
        change = rubbing - last
        still = float(np.abs(change).max()) <= _STILL * float(bound.max())
        if still or (step % _TURN == 0 and step < _STEPS):
            before, normal = normal, among.pressed(rubbing)
            if still and np.linalg.norm(normal - before) <= _SETTLED * np.linalg.norm(before):
                break
            slip, bound = among.under(normal)
        faster = 0.5 + math.sqrt(0.25 + pace * pace)
        expected = rubbing + (pace - 1.0) / faster * change
        pace = faster
    return np.vstack([normal, _cut(rubbing, bound).reshape(friction.T.shape)]).T


def _largest(matrix: Array, rho: Array) -> float:
    """Largest eigenvalue of a compliance (k, k) weighed by rho: of a motion of all points alike, nearly."""
    root = np.sqrt(rho)
    vector = root
    for _ in range(3):
        vector = root * (matrix @ (root * vector / np.linalg.norm(vector)))
    return 1.1 * float(np.linalg.norm(vector))


def _cut(friction: Array, bound: Array) -> Array:
    """Friction (k (d - 1),) cut back to its bound (k,)."""
    k = len(bound)
    if len(friction) == k:
        return np.minimum(np.maximum(friction, -bound), bound)
    along, across = friction[:k], friction[k:]
    share = bound / np.maximum(np.maximum(np.sqrt(along * along + across * across), bound), _TINY)
    return (friction.reshape(2, k) * share).ravel()
