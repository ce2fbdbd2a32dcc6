"""Multifrontal factorisation of symmetric quasi-definite matrices with dense BLAS, for machines without MKL.

A stiffness is positive definite; that of displacements and pressures is quasi-definite, ``[[A, B^T], [B, -C]]`` with A
and C positive definite, and has a factor ``L D L^T`` with D = diag(+-1) in every order of elimination, without pivoting
(Vanderbei 1995, Symmetric quasidefinite matrices, SIAM J. Optim. 5). The unknowns of a separator are eliminated
together from a dense front (Duff and Reid 1983), whose Schur complement is added to the front of the parent. The rows R
of ``[[K, R^T], [R, 0]]`` are never eliminated: what is left for them at the end is ``-R K^-1 R^T``.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int
from finger3d.fem.dissection import dissect

_MOST_RUNS = 24
"""Runs of consecutive places up to which a block is added run by run, and not entry by entry."""


_RESIDUAL = 1e-11
"""Largest residual of a solution over the size of its terms; 1e-14 was measured on rubber, nu = 0.49."""


class NotQuasiDefiniteError(ArithmeticError):
    """The matrix is not symmetric quasi-definite: without pivoting it has no factor."""


@dataclass(frozen=True)
class _Front:
    """Unknowns that are eliminated together, numbered in the order of elimination.

    Attributes
    ----------
    start, middle, end : unknowns with a positive diagonal are start to middle, the others middle to end
    boundary : (b,) numbers of later unknowns and rows that these are coupled to, ascending
    children : numbers of the fronts whose Schur complements are added
    """

    start: int
    middle: int
    end: int
    boundary: Int
    children: tuple[int, ...]


class Plan:
    """Order of elimination and fronts of a pattern; matrices with the same pattern share it.

    Parameters
    ----------
    upper : (n, n) sparse
        Upper triangle of K, every diagonal entry stored.
    rows : (r, n) sparse
    """

    def __init__(self, upper: sp.csr_matrix, rows: sp.csr_matrix) -> None:
        self.key = (upper.indptr, upper.indices, rows.indptr, rows.indices)
        n, r = upper.shape[0], rows.shape[0]
        ones = sp.csr_matrix((np.ones(upper.nnz), upper.indices, upper.indptr), upper.shape)
        tree = dissect((ones + sp.triu(ones, 1).T).tocsr())
        self.is_negative = upper.diagonal() <= 0.0
        unknowns = [u[np.argsort(self.is_negative[u], kind="stable")] for u in tree.unknowns]
        self.order = np.concatenate([*unknowns, np.arange(n, n + r)])
        self.rank = np.empty(n + r, dtype=np.int64)
        self.rank[self.order] = np.arange(n + r)
        lower = self.permuted(upper, rows)
        fronts: list[_Front] = []
        end = 0
        for own, children in zip(unknowns, tree.children, strict=True):
            start, end = end, end + len(own)
            coupled = [lower.indices[lower.indptr[start] : lower.indptr[end]], *(fronts[c].boundary for c in children)]
            boundary = np.unique(np.concatenate(coupled))
            middle = end - int(np.count_nonzero(self.is_negative[own]))
            fronts.append(_Front(start, middle, end, boundary[boundary >= end], children))
        self.fronts = tuple(fronts)

    def fits(self, upper: sp.csr_matrix, rows: sp.csr_matrix) -> bool:
        """Whether a matrix has the same pattern, and diagonal entries of the same signs."""
        key = (upper.indptr, upper.indices, rows.indptr, rows.indices)
        return all(map(np.array_equal, key, self.key)) and np.array_equal(upper.diagonal() <= 0.0, self.is_negative)

    def permuted(self, upper: sp.csr_matrix, rows: sp.csr_matrix) -> sp.csc_matrix:
        """Return the lower triangle of ``[[K, R^T], [R, 0]]`` in the order of elimination."""
        n, (above, read) = upper.shape[0], (upper.tocoo(), rows.tocoo())
        one = self.rank[np.concatenate([above.row, read.row + n])]
        other = self.rank[np.concatenate([above.col, read.col])]
        values = np.concatenate([above.data, read.data])
        size = len(self.order)
        return sp.csc_matrix((values, (np.maximum(one, other), np.minimum(one, other))), (size, size))


class Multifrontal:
    """Factor of K, and the Schur complement of the rows R.

    Parameters
    ----------
    plan : of the pattern of `upper` and `rows`
    upper, rows : as for `Plan`

    Attributes
    ----------
    schur : (r, r)
        ``-R K^-1 R^T``.

    Raises
    ------
    NotQuasiDefiniteError
        If K has no factor without pivoting, or no accurate one.
    """

    def __init__(self, plan: Plan, upper: sp.csr_matrix, rows: sp.csr_matrix) -> None:
        self.plan, self._n, self._r = plan, upper.shape[0], rows.shape[0]
        matrix = plan.permuted(upper, rows)
        complements: dict[int, Float] = {}
        self._factors: list[tuple[Float, Float]] = []
        for number, front in enumerate(plan.fronts):
            pivot, below, rest = _assembled(front, matrix)
            for child in front.children:
                _extend(front, pivot, below, rest, plan.fronts[child].boundary, complements.pop(child))
            factor, panel = _eliminate(front, pivot, below, rest)
            self._factors.append((factor, panel))
            complements[number] = rest
        self.schur = np.zeros((self._r, self._r), order="F")
        for number, rest in complements.items():
            places = plan.fronts[number].boundary - self._n
            self.schur[np.ix_(places, places)] += np.tril(rest) + np.tril(rest, -1).T
        self._verify(upper)

    def _verify(self, upper: sp.csr_matrix) -> None:
        """Raise a NotQuasiDefiniteError if a solution leaves a residual: growth of round-off without pivoting."""
        load = np.random.default_rng(0).standard_normal((self._n, 1))
        x = self.substituted(self.eliminated(load)[0], np.zeros((self._r, 1)))
        magnitude = abs(upper)
        left = upper @ x + upper.T @ x - upper.diagonal()[:, None] * x - load
        size = magnitude @ abs(x) + magnitude.T @ abs(x) + abs(load)
        if not np.abs(left).max() <= _RESIDUAL * size.max():
            raise NotQuasiDefiniteError("round-off grows without pivoting")

    def eliminated(self, load: Float) -> tuple[Float, Float]:
        """Forward substitution of loads (n, m): what `substituted` needs of it, and ``R K^-1 load`` (r, m)."""
        from scipy.linalg.blas import dtrsm

        x = np.zeros((self._n + self._r, load.shape[1]))
        x[: self._n] = load[self.plan.order[: self._n]]
        for front, (factor, panel) in zip(self.plan.fronts, self._factors, strict=True):
            own = dtrsm(1.0, factor, x[front.start : front.end], lower=1)
            own[front.middle - front.start :] *= -1.0
            x[front.start : front.end] = own
            x[front.boundary] -= panel @ own
        return x[: self._n], -x[self._n :]

    def substituted(self, eliminated: Float | None, force: Float) -> Float:
        """Backward substitution: ``K^-1 (load + R^T force)`` (n, m) for eliminated loads, if any, and forces (r, m)."""
        from scipy.linalg.blas import dtrsm

        x = np.zeros((self._n + self._r, force.shape[1]))
        if eliminated is not None:
            x[: self._n] = eliminated
        x[self._n :] = -force
        for front, (factor, panel) in zip(reversed(self.plan.fronts), reversed(self._factors), strict=True):
            coupled = panel.T @ x[front.boundary]
            coupled[front.middle - front.start :] *= -1.0
            own = x[front.start : front.end] - coupled
            x[front.start : front.end] = dtrsm(1.0, factor, own, lower=1, trans_a=1)
        found = np.empty((self._n, force.shape[1]))
        found[self.plan.order[: self._n]] = x[: self._n]
        return found


def _assembled(front: _Front, matrix: sp.csc_matrix) -> tuple[Float, Float, Float]:
    """Return pivot block (p, p), panel (b, p) and rest (b, b) of a front with the entries of the matrix."""
    p, b = front.end - front.start, len(front.boundary)
    pivot, below, rest = np.zeros((p, p), order="F"), np.zeros((b, p), order="F"), np.zeros((b, b), order="F")
    part = slice(matrix.indptr[front.start], matrix.indptr[front.end])
    row, value = matrix.indices[part], matrix.data[part]
    column = np.repeat(np.arange(p), np.diff(matrix.indptr[front.start : front.end + 1]))
    inside = row < front.end
    pivot[row[inside] - front.start, column[inside]] = value[inside]
    below[np.searchsorted(front.boundary, row[~inside]), column[~inside]] = value[~inside]
    return pivot, below, rest


def _extend(front: _Front, pivot: Float, below: Float, rest: Float, boundary: Int, complement: Float) -> None:
    """Add a child's Schur complement, of which the lower triangle is given, to a front."""
    own = int(np.searchsorted(boundary, front.end))
    first, last = boundary[:own] - front.start, np.searchsorted(front.boundary, boundary[own:])
    _add(pivot, first, first, complement[:own, :own])
    _add(below, last, first, complement[own:, :own])
    _add(rest, last, last, complement[own:, own:])


def _add(block: Float, rows: Int, columns: Int, values: Float) -> None:
    """Add values to rows and columns of a block; both ascend and have no duplicates."""
    down, along = _runs(rows), _runs(columns)
    if max(len(down), len(along)) > _MOST_RUNS:
        block[np.ix_(rows, columns)] += values
        return
    for a, b in pairwise(down):
        for c, d in pairwise(along):
            block[rows[a] : rows[a] + b - a, columns[c] : columns[c] + d - c] += values[a:b, c:d]


def _runs(places: Int) -> list[int]:
    """Return where runs of consecutive places start, and the number of places."""
    if not len(places):
        return [0]
    return [0, *(np.flatnonzero(np.diff(places) != 1) + 1).tolist(), len(places)]


def _eliminate(front: _Front, pivot: Float, below: Float, rest: Float) -> tuple[Float, Float]:
    """Factor the pivot block as ``L D L^T``; return L and the panel ``below L^-T``, and update the rest."""
    from scipy.linalg.blas import dsyrk, dtrsm

    m = front.middle - front.start
    if m in (0, len(pivot)):
        factor = _cholesky(pivot if m else -pivot)
    else:
        factor = np.zeros_like(pivot, order="F")
        factor[:m, :m] = _cholesky(pivot[:m, :m])
        factor[m:, :m] = dtrsm(1.0, factor[:m, :m], pivot[m:, :m], side=1, lower=1, trans_a=1)
        factor[m:, m:] = _cholesky(factor[m:, :m] @ factor[m:, :m].T - pivot[m:, m:])
    if not len(rest):
        return factor, below
    panel = dtrsm(1.0, factor, below, side=1, lower=1, trans_a=1, overwrite_b=1)
    for sign, part in ((-1.0, panel[:, :m]), (1.0, panel[:, m:])):
        if part.shape[1]:
            updated = dsyrk(sign, part, beta=1.0, c=rest, lower=1, overwrite_c=1)
            assert updated is rest or np.shares_memory(updated, rest)
    return factor, panel


def _cholesky(matrix: Float) -> Float:
    from scipy.linalg.lapack import dpotrf

    factor, info = dpotrf(matrix, lower=1, clean=1)
    if info:
        raise NotQuasiDefiniteError("a pivot block is not definite")
    return np.asarray(factor)
