"""Lemke's method for frictional contact as a linear complementarity problem; it is slow, but cannot cycle.

With the friction circle as a polygon of directions D, find n, beta, lam >= 0 with ``0 <= n _|_ gap >= 0``,
``0 <= beta _|_ D^T slip + lam >= 0``, ``0 <= lam _|_ mu n - sum(beta) >= 0``.  Its matrix is copositive, and Lemke's
method then ends in a solution for every coefficient and every load (Anitescu and Potra 1997, after Stewart and
Trinkle 1996).  In 2D the polygon is exact; in 3D it is a start for Newton.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import OPEN, SLIP, STICK

_PIVOT = 1e-11

_LARGEST_RATES = 1200
"""Largest number of rows of the tableau of `rates_start`."""


def directions(tangents: int, facets: int = 8) -> Float:
    """Unit directions (k, d - 1) that span the tangent plane: two in 2D, a regular polygon in 3D."""
    if tangents == 1:
        return np.array([[1.0], [-1.0]])
    angle = 2.0 * np.pi * np.arange(facets) / facets
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def lemke(matrix: Float, q: Float, limit: int) -> Float | None:
    """Return the solution z (m,) of ``0 <= z _|_ matrix z + q >= 0``; None if it ends in a ray or after `limit` pivots.

    A small irregular perturbation of q replaces the lexicographic rule against ties.  The relative error of z is about
    1e-8, which is enough to determine the active set.
    """
    m = len(q)
    if q.min() >= 0.0:
        return np.zeros(m)
    shift = 1e-9 * np.abs(q).max() * np.random.default_rng(0).uniform(1.0, 2.0, m)
    table = np.hstack([np.eye(m), -matrix, -np.ones((m, 1)), (q + shift)[:, None]])
    basis = np.arange(m)
    entering = 2 * m
    row = int(np.argmin(q + shift))
    for _ in range(limit):
        table[row] /= table[row, entering]
        column = table[:, entering].copy()
        column[row] = 0.0
        used = np.flatnonzero(column)
        table[used] -= column[used, None] * table[row]
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * m:
            z = np.zeros(2 * m + 1)
            z[basis] = table[:, -1]
            return np.maximum(z[m : 2 * m], 0.0)
        entering = leaving + m if leaving < m else leaving - m
        rise = table[:, entering]
        candidates = np.flatnonzero(rise > _PIVOT)
        if not len(candidates):
            return None
        ratio = table[candidates, -1] / rise[candidates]
        least = candidates[ratio <= ratio.min() + 1e-14]
        artificial = least[basis[least] == 2 * m]
        row = int(artificial[0]) if len(artificial) else int(least[np.argmax(rise[least])])
    return None


def friction_start(
    problem: ContactProblem, points: NDArray[np.int64], largest: int
) -> tuple[NDArray[np.int8], Float] | None:
    """Return status (c,) and slip directions (c, d - 1) of the polygonal problem over `points`.

    None if there is no solution, or if the tableau would have more than `largest` rows.
    """
    c, d = problem.free_motion.shape
    span = directions(d - 1)
    k, p = len(span), len(points)
    if p == 0 or p * (k + 2) > largest:
        return None
    dof = (points[:, None] * d + np.arange(d)).ravel()
    stiff = 1.0 / np.diagonal(problem.delassus)[dof].mean()
    block = (problem.delassus[np.ix_(dof, dof)] * stiff).reshape(p, d, p, d)
    free = problem.free_motion[points] / max(float(np.abs(problem.free_motion[points]).max()), 1e-300)
    m = p * (k + 2)
    matrix = np.zeros((m, m))
    n, b, lam = slice(0, p), slice(p, p + p * k), slice(p + p * k, m)
    matrix[n, n] = block[:, 0, :, 0]
    matrix[n, b] = np.einsum("ijt,kt->ijk", block[:, 0, :, 1:], span).reshape(p, p * k)
    matrix[b, n] = np.einsum("kt,itj->ikj", span, block[:, 1:, :, 0]).reshape(p * k, p)
    matrix[b, b] = np.einsum("kt,itju,lu->ikjl", span, block[:, 1:, :, 1:], span).reshape(p * k, p * k)
    choose = np.kron(np.eye(p), np.ones((k, 1)))
    matrix[b, lam] = choose
    matrix[lam, n] = np.diag(problem.friction[points])
    matrix[lam, b] = -choose.T
    q = np.concatenate([free[:, 0], (free[:, 1:] @ span.T).ravel(), np.zeros(p)])
    z = lemke(matrix, q, 20 * m)
    if z is None:
        return None
    tangent = z[b].reshape(p, k) @ span
    touching, slipping = z[n] > 0.0, z[lam] > 0.0
    status = np.full(c, OPEN, dtype=np.int8)
    status[points] = np.where(touching, np.where(slipping, SLIP, STICK), OPEN)
    direction = np.zeros((c, d - 1))
    direction[points] = tangent
    return status, direction


def rates_start(
    problem: ContactProblem,
    rate: Float,
    points: tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]],
    sign: Float,
    bordered: tuple[Float, float, Float] | None = None,
) -> tuple[NDArray[np.int8], Float] | None:
    """Return status (c,) and direction of friction (c,) that the rates of forces have in a section, or None.

    Parameters
    ----------
    rate : (c, 2) mm, of the free motion
    points : (c,) each
        Points that stick, points at their friction limit, which stick or slip, and points without gap and force.
    sign : (c,), direction of friction of points at their limit
    bordered : (c, 2) weights, rate in N and (c, 2) motion in mm, of a resultant that is prescribed
    """
    stick, at_limit, at_apex = points
    c, mu, w, q = len(sign), problem.friction, problem.delassus, rate.ravel()
    apex, limit = np.flatnonzero(at_apex), np.flatnonzero(at_limit)
    unit = np.eye(2 * c).reshape(c, 2, 2 * c)  # [point, direction] -> force of size 1
    n, t = unit[:, 0], unit[:, 1]
    bilateral = np.concatenate([n[stick], t[stick], (n + (sign * mu)[:, None] * t)[limit]])
    zero = np.concatenate([n[stick], t[stick], n[limit]])  # displacements that vanish
    forces = np.concatenate([-sign[limit, None] * t[limit], n[apex], t[apex], -t[apex]])
    f, k, b = len(forces), len(apex), len(bilateral)
    m = f + k
    if m > _LARGEST_RATES:
        return None
    equations, right = zero @ w @ bilateral.T, zero @ np.column_stack([w @ forces.T, q])
    into = forces @ np.column_stack([w @ bilateral.T, w @ forces.T, q])
    if bordered is not None:
        weights, change, motion = bordered[0].ravel(), bordered[1], bordered[2].ravel()
        equations = np.block([[equations, (zero @ motion)[:, None]], [weights @ bilateral.T, np.zeros(1)]])
        right = np.vstack([right, [*(weights @ forces.T), -change]])
        into = np.column_stack([into[:, :b], forces @ motion, into[:, b:]])
        b += 1
    try:
        reduced = into[:, b:] - into[:, :b] @ np.linalg.solve(equations, right)
    except np.linalg.LinAlgError:
        return None
    matrix, load = np.zeros((m, m)), np.zeros(m)
    matrix[:f, :f], load[:f] = reduced[:, :-1], reduced[:, -1]
    normals, towards, away = (slice(f - (3 - i) * k, f - (2 - i) * k) for i in range(3))
    matrix[towards, f:] = matrix[away, f:] = np.eye(k)
    matrix[f:, normals], matrix[f:, towards], matrix[f:, away] = np.diag(mu[apex]), -np.eye(k), -np.eye(k)
    matrix[:f, :f] /= np.abs(matrix[:f, :f]).max(initial=0.0) or 1.0
    z = lemke(matrix, load / (np.abs(load).max(initial=0.0) or 1.0), 20 * m)
    if z is None:
        return None
    status, direction = np.full(c, OPEN, dtype=np.int8), sign.copy()
    status[stick] = STICK
    status[limit] = np.where(z[: len(limit)] > 0.0, STICK, SLIP)
    status[apex] = np.where(z[normals] > 0.0, np.where(z[f:] > 0.0, SLIP, STICK), OPEN)
    direction[apex] = np.sign(z[towards] - z[away])
    return status, direction
