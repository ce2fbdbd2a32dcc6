"""Condensation of a body to a few rows of interest: one factorisation, one small dense compliance.

PARDISO returns ``R K^-1 R^T`` as a Schur complement for about the price of factoring K; where there is
no MKL, SuperLU factors K and solves for every row, behind the same interface.
"""

from __future__ import annotations

import itertools
import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._arrays import freeze_arrays
from finger3d._types import Float, Int
from finger3d.fem.assembly import Stiffness

if TYPE_CHECKING:
    from finger3d.fem.pardiso import SchurFactor


_SOLVE_CHUNK = 64


@dataclass(frozen=True)
class Condensation:
    """A body condensed to its rows.

    Attributes
    ----------
    compliance : (r, r) mm/N
        Row displacements per unit row force, symmetric: ``R K^-1 R^T``.
    perturbed_pivots : int
        0 for a trustworthy factor.
    """

    compliance: Float
    perturbed_pivots: int
    factorizations: int
    seconds: float
    solver: str
    _rows: sp.csr_matrix = field(repr=False)
    _free: Int = field(repr=False)
    _solve: Callable[[Float], Float] = field(repr=False)
    _series: _Series | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def unknowns(self, force: Float) -> Float:
        """All unknowns (N, ...) under row forces (r, ...) N: displacements in mm, then pressures.

        Several forces as columns (r, k) cost less than one after another.
        """
        return self.solve(self._rows.T @ force)

    def solve(self, load: Float) -> Float:
        """All unknowns (N, ...) under loads (N, ...); fixed unknowns are zero."""
        whole = np.zeros(load.shape, order="F")  # one field after another
        whole[self._free] = self._solve(load[self._free])
        return whole

    def read(self, unknowns: Float) -> Float:
        """Row displacements (r,) mm of all unknowns (N,)."""
        return np.asarray(self._rows @ unknowns)

    def again(self, stiffness: Stiffness) -> Condensation:
        """Condense another stiffness with the same fixed unknowns and rows; this takes one more factorisation."""
        fixed = np.setdiff1d(np.arange(self._rows.shape[1]), self._free)
        return condense(stiffness, fixed, self._rows, self.solver)


def condense(
    stiffness: Stiffness, fixed: Int, rows: sp.csr_matrix, solver: str | None = None, spent: Condensation | None = None
) -> Condensation:
    """Condense a stiffness to rows.

    Parameters
    ----------
    stiffness : upper triangle (N, N)
    fixed : numbers of the unknowns held at zero
    rows : (r, n d) sparse
        What is read: row displacement = rows @ u; row forces act through the transpose.
    solver : "pardiso" or "superlu"; default FINGER3D_SOLVER, else PARDISO where it is installed
    spent : a body that is not needed any more
        PARDISO overwrites its factor, and keeps its ordering if the entries stand in the same places; that body keeps
        its compliance but can no longer solve.
    """
    start = time.perf_counter()
    upper, size = stiffness.upper, stiffness.upper.shape[0]
    if not upper.has_sorted_indices:
        upper = upper.sorted_indices()
    solver = solver or os.environ.get("FINGER3D_SOLVER") or _default_solver()
    keep = np.ones(size, dtype=bool)
    keep[fixed] = False
    free = np.flatnonzero(keep)
    padded = sp.csr_matrix((rows.data, rows.indices, rows.indptr), shape=(rows.shape[0], size))
    # PARDISO perturbs pivots below 1e-13 of the largest entry of [[K, R^T], [R, 0]]: K and every row of R are scaled to
    # entries of order 1, by powers of two, so that neither the modulus nor the unit of a row changes a digit.
    unit, units = _power_of_two(upper.data), _row_scales(padded)
    scaled = sp.csr_matrix((upper.data / unit, upper.indices, upper.indptr), shape=upper.shape)
    entries = padded.data / np.repeat(units, np.diff(padded.indptr))
    read = sp.csr_matrix((entries, padded.indices, padded.indptr), shape=padded.shape)
    series: _Series | None = None
    factor_solve: Callable[[Float], Float]
    if solver == "pardiso":
        series = _Series.of(scaled, free, read, spent._series if spent else None)
        compliance, perturbed, factor_solve = -series.factor.schur, series.factor.perturbed, series.solve
    else:
        compliance, perturbed, factor_solve = _superlu(scaled[free][:, free], read[:, free].tocsr())
    compliance = units[:, None] * (0.5 / unit * (compliance + compliance.T)) * units

    def solve(load: Float) -> Float:
        return factor_solve(load) / unit

    seconds = time.perf_counter() - start
    return Condensation(compliance, perturbed, 1, seconds, solver, padded, free, solve, series)


def _power_of_two(values: Float) -> float:
    """Power of two next to the largest magnitude of `values`; 1 if there is none."""
    largest = float(np.abs(values).max(initial=0.0))
    return 2.0 ** round(math.log2(largest)) if 0.0 < largest < math.inf else 1.0


def _row_scales(rows: sp.csr_matrix) -> Float:
    """Power of two (r,) next to the largest magnitude in every row of a sparse matrix."""
    return np.array([_power_of_two(rows.data[a:b]) for a, b in itertools.pairwise(rows.indptr)])


def spring_forces(compliance: Float, springs: Float, moved: Float) -> Float:
    """Forces (s, ...) N of springs (s,) N/mm on the last s rows of a body, which without them would move by `moved`.

    Woodbury's formula: with any number of springs on its rows a body keeps its factorisation.
    """
    first = len(compliance) - len(springs)
    root = np.sqrt(springs)
    inner = np.eye(len(springs)) + root[:, None] * compliance[first:, first:] * root
    scaled = (root * moved[first:].T).T
    return np.asarray(-(root * np.linalg.solve(inner, scaled).T).T)


def stiffened(compliance: Float, springs: Float) -> Float:
    """Compliance (r, r) of a body once springs (s,) N/mm hold its last s rows."""
    if not len(springs):
        return compliance
    first = len(compliance) - len(springs)
    found = compliance + compliance[:, first:] @ spring_forces(compliance, springs, compliance)
    return 0.5 * (found + found.T)


def _default_solver() -> str:
    from finger3d.fem.pardiso import available

    return "pardiso" if available() else "superlu"


@dataclass(frozen=True)
class _Places:
    """Where the entries of stiffness and rows stand in PARDISO's matrix ``[[K, R^T], [R, 0]]`` of the free unknowns.

    Attributes
    ----------
    given : what must be the same for another stiffness and other rows to stand there too
    kept : (nnz of the stiffness,) whether an entry is of free unknowns
    body : (nnz of PARDISO's matrix,) whether an entry is one of these; the others are of the rows, or zeros
    beside, take : numbers of the places of entries of the rows, and of these entries
    """

    given: tuple[Int, ...]
    kept: NDArray[np.bool_]
    body: NDArray[np.bool_]
    beside: Int
    take: Int

    def values(self, upper: sp.csr_matrix, rows: sp.csr_matrix) -> Float:
        """Entries (nnz,) of PARDISO's matrix."""
        found = np.zeros(len(self.body))
        found[self.body] = upper.data[self.kept]
        found[self.beside] = rows.data[self.take]
        return found


@dataclass(frozen=True)
class _Series:
    """PARDISO's factor, and the places in its matrix: for the next such matrix.

    `number` is that of the factorisation: the next one in the same places overwrites the factor.
    """

    places: _Places
    factor: SchurFactor
    number: int = 1

    @property
    def current(self) -> bool:
        """Whether the factor is still the one of this matrix."""
        return self.number == self.factor.factorizations

    def solve(self, load: Float) -> Float:
        """Displacements ``K^-1 load``; raises RuntimeError once another matrix has been factored in its place."""
        if not self.current:
            raise RuntimeError("the factor of this condensed body was overwritten by a later one; condense it again")
        return self.factor.solve(load)

    @classmethod
    def of(cls, upper: sp.csr_matrix, free: Int, rows: sp.csr_matrix, spent: _Series | None) -> _Series:
        """Factor the free unknowns with the rows beside them, in the places of an earlier one where it fits."""
        from finger3d.fem.pardiso import SchurFactor

        given = (upper.indptr, upper.indices, free, rows.indptr, rows.indices)
        if spent and spent.current and all(map(np.array_equal, given, spent.places.given)):
            spent.factor.renew(spent.places.values(upper, rows))
            return cls(spent.places, spent.factor, spent.factor.factorizations)
        places, matrix = _augmented(upper, free, rows)
        return cls(places, SchurFactor(matrix, rows.shape[0]))


def _augmented(upper: sp.csr_matrix, free: Int, rows: sp.csr_matrix) -> tuple[_Places, sp.csr_matrix]:
    """Upper triangle of ``[[K, R^T], [R, 0]]``; the entries of R^T follow those of K in every row."""
    n, r = len(free), rows.shape[0]
    is_free = np.zeros(upper.shape[0], dtype=np.bool_)
    is_free[free] = True
    kept = is_free[upper.indices]
    kept &= np.repeat(is_free, np.diff(upper.indptr))
    own = np.add.reduceat(kept, upper.indptr[:-1], dtype=np.int64)[free]  # no row is empty: it has its diagonal
    numbered = sp.csr_matrix((np.arange(rows.nnz), rows.indices, rows.indptr), rows.shape)
    turned = numbered[:, free].T.tocsr()
    more = np.diff(turned.indptr)
    indptr = np.concatenate([[0], np.cumsum(np.concatenate([own + more, np.ones(r, dtype=np.int64)]))])
    beside = np.arange(turned.nnz) + np.repeat(np.cumsum(own), more)
    body = np.ones(indptr[-1], dtype=np.bool_)
    body[beside] = False
    body[len(body) - r :] = False
    number = np.cumsum(is_free, dtype=upper.indices.dtype) - 1
    indices = np.empty(len(body), dtype=upper.indices.dtype)
    indices[body] = number[upper.indices[kept]]
    indices[beside] = n + turned.indices
    indices[len(body) - r :] = np.arange(n, n + r)
    places = _Places((upper.indptr, upper.indices, free, rows.indptr, rows.indices), kept, body, beside, turned.data)
    return places, sp.csr_matrix((places.values(upper, rows), indices, indptr), shape=(n + r, n + r))


def _superlu(upper: sp.csr_matrix, rows: sp.csr_matrix) -> tuple[Float, int, Callable[[Float], Float]]:
    from scipy.sparse.linalg import splu

    full = (upper + sp.triu(upper, 1).T).tocsc()
    factor = splu(full, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    compliance = np.empty((rows.shape[0], rows.shape[0]))
    for start in range(0, rows.shape[0], _SOLVE_CHUNK):
        part = slice(start, start + _SOLVE_CHUNK)
        compliance[:, part] = rows @ factor.solve(rows[part].T.toarray())
    return compliance, 0, factor.solve
