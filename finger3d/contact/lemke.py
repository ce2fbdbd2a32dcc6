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
