"""Condensation of a body to some rows of its displacements: one factorisation, and a dense compliance.

PARDISO returns ``R K^-1 R^T`` as a Schur complement at about the cost of factoring K.  Without MKL, SuperLU factors K
and solves for every row.
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
        Number of pivots that PARDISO replaced; 0 if the factor is accurate.
    """

    compliance: Float
    perturbed_pivots: int
    factorizations: int
    seconds: float
    solver: str
    _rows: sp.csr_matrix = field(repr=False)
    _free: Int = field(repr=False)
    _solve: Callable[[Float], Float] = field(repr=False)
    _factorization: _Factorization | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def unknowns(self, force: Float) -> Float:
        """Return all unknowns (N, ...) under row forces (r, ...), N: displacements in mm, then pressures.

        Several forces in the columns of an array (r, k) cost less than one after another.
        """
        return self.solve(self._rows.T @ force)

    def solve(self, load: Float) -> Float:
        """Return all unknowns (N, ...) under loads (N, ...); fixed unknowns are zero."""
        whole = np.zeros(load.shape, order="F")  # one field after another
        whole[self._free] = self._solve(load[self._free])
        return whole

    def read(self, unknowns: Float) -> Float:
        """Return the row displacements (r,), mm, of all unknowns (N,)."""
        return np.asarray(self._rows @ unknowns)

    def again(self, stiffness: Stiffness) -> Condensation:
        """Condense another stiffness with the same fixed unknowns and rows; this takes one more factorisation."""
        fixed = np.setdiff1d(np.arange(self._rows.shape[1]), self._free)
        return condense(stiffness, fixed, self._rows, self.solver)


def condense(
    stiffness: Stiffness,
    fixed: Int,
    rows: sp.csr_matrix,
    solver: str | None = None,
    replaced: Condensation | None = None,
) -> Condensation:
    """Condense a stiffness to rows.

    Parameters
    ----------
    stiffness : upper triangle (N, N)
    fixed : numbers of the unknowns held at zero
    rows : (r, n d) sparse
        What is read: row displacement = rows @ u; row forces act through the transpose.
    solver : "pardiso" or "superlu"; default FINGER3D_SOLVER, else PARDISO where it is installed
    replaced : a condensed body that is no longer needed
        If it has the same sparsity pattern, PARDISO keeps its ordering and overwrites its factor; that body keeps its
        compliance, but can no longer solve.
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
    factorization: _Factorization | None = None
    factor_solve: Callable[[Float], Float]
    if solver == "pardiso":
        factorization = _Factorization.of(scaled, free, read, replaced._factorization if replaced else None)
        compliance, perturbed = -factorization.factor.schur, factorization.factor.perturbed
        factor_solve = factorization.solve
    else:
        compliance, perturbed, factor_solve = _superlu(scaled[free][:, free], read[:, free].tocsr())
    compliance = units[:, None] * (0.5 / unit * (compliance + compliance.T)) * units

    def solve(load: Float) -> Float:
        return factor_solve(load) / unit

    seconds = time.perf_counter() - start
    return Condensation(compliance, perturbed, 1, seconds, solver, padded, free, solve, factorization)


def _power_of_two(values: Float) -> float:
    """Return the power of two nearest to the largest magnitude of `values`, or 1 if there is none."""
    largest = float(np.abs(values).max(initial=0.0))
    return 2.0 ** round(math.log2(largest)) if 0.0 < largest < math.inf else 1.0


def _row_scales(rows: sp.csr_matrix) -> Float:
    """Return the power of two (r,) nearest to the largest magnitude in each row of a sparse matrix."""
    return np.array([_power_of_two(rows.data[a:b]) for a, b in itertools.pairwise(rows.indptr)])


def spring_forces(compliance: Float, springs: Float, displacement: Float) -> Float:
    """Return the forces (s, ...), N, of springs on the last s rows of a body, by Woodbury's formula.

    Parameters
    ----------
    compliance : (r, r) array, mm/N
        Of the body without springs.
    springs : (s,) array, N/mm
    displacement : (r, ...) array, mm
        Row displacements without springs.
    """
    first = len(compliance) - len(springs)
    root = np.sqrt(springs)
    inner = np.eye(len(springs)) + root[:, None] * compliance[first:, first:] * root
    scaled = (root * displacement[first:].T).T
    return np.asarray(-(root * np.linalg.solve(inner, scaled).T).T)


def stiffened(compliance: Float, springs: Float) -> Float:
    """Return the compliance (r, r) of a body with springs (s,), N/mm, on its last s rows."""
    if not len(springs):
        return compliance
    first = len(compliance) - len(springs)
    found = compliance + compliance[:, first:] @ spring_forces(compliance, springs, compliance)
    return 0.5 * (found + found.T)


def _default_solver() -> str:
    from finger3d.fem.pardiso import available

    return "pardiso" if available() else "superlu"


@dataclass(frozen=True)
class _Pattern:
    """Sparsity pattern of PARDISO's matrix ``[[K, R^T], [R, 0]]`` of the free unknowns.

    Attributes
    ----------
    key : index arrays of stiffness and rows; the same arrays give the same pattern
    is_kept : (nnz of the stiffness,) whether both unknowns of an entry are free
    is_stiffness : (nnz of PARDISO's matrix,) whether an entry is one of the stiffness
    row_places, row_entries : places of the entries of the rows, and which entries these are
    """

    key: tuple[Int, ...]
    is_kept: NDArray[np.bool_]
    is_stiffness: NDArray[np.bool_]
    row_places: Int
    row_entries: Int

    def values(self, upper: sp.csr_matrix, rows: sp.csr_matrix) -> Float:
        """Return the entries (nnz,) of PARDISO's matrix."""
        found = np.zeros(len(self.is_stiffness))
        found[self.is_stiffness] = upper.data[self.is_kept]
        found[self.row_places] = rows.data[self.row_entries]
        return found


@dataclass(frozen=True)
class _Factorization:
    """PARDISO's factor of one matrix; a later matrix of the same pattern may overwrite it.

    `number` counts the matrices that this factor has been computed for.
    """

    pattern: _Pattern
    factor: SchurFactor
    number: int = 1

    @property
    def is_current(self) -> bool:
        """Whether the factor is still that of this matrix."""
        return self.number == self.factor.factorizations

    def solve(self, load: Float) -> Float:
        """Return the displacements ``K^-1 load``.

        Raises
        ------
        RuntimeError
            If the factor has been overwritten.
        """
        if not self.is_current:
            raise RuntimeError("the factor of this condensed body was overwritten by a later one; condense it again")
        return self.factor.solve(load)

    @classmethod
    def of(
        cls, upper: sp.csr_matrix, free: Int, rows: sp.csr_matrix, replaced: _Factorization | None
    ) -> _Factorization:
        """Factor the matrix of the free unknowns and the rows, reusing an earlier factor of the same pattern."""
        from finger3d.fem.pardiso import SchurFactor

        key = (upper.indptr, upper.indices, free, rows.indptr, rows.indices)
        if replaced and replaced.is_current and all(map(np.array_equal, key, replaced.pattern.key)):
            replaced.factor.renew(replaced.pattern.values(upper, rows))
            return cls(replaced.pattern, replaced.factor, replaced.factor.factorizations)
        pattern, matrix = _augmented(upper, free, rows)
        return cls(pattern, SchurFactor(matrix, rows.shape[0]))


def _augmented(upper: sp.csr_matrix, free: Int, rows: sp.csr_matrix) -> tuple[_Pattern, sp.csr_matrix]:
    """Return the upper triangle of ``[[K, R^T], [R, 0]]``; in each row the entries of R^T follow those of K."""
    n, r = len(free), rows.shape[0]
    is_free = np.zeros(upper.shape[0], dtype=np.bool_)
    is_free[free] = True
    kept = is_free[upper.indices]
    kept &= np.repeat(is_free, np.diff(upper.indptr))
    own = np.add.reduceat(kept, upper.indptr[:-1], dtype=np.int64)[free]  # no row is empty: it has its diagonal
    numbered = sp.csr_matrix((np.arange(rows.nnz), rows.indices, rows.indptr), rows.shape)
    transposed = numbered[:, free].T.tocsr()
    more = np.diff(transposed.indptr)
    indptr = np.concatenate([[0], np.cumsum(np.concatenate([own + more, np.ones(r, dtype=np.int64)]))])
    row_places = np.arange(transposed.nnz) + np.repeat(np.cumsum(own), more)
    stiffness = np.ones(indptr[-1], dtype=np.bool_)
    stiffness[row_places] = False
    stiffness[len(stiffness) - r :] = False
    number = np.cumsum(is_free, dtype=upper.indices.dtype) - 1
    indices = np.empty(len(stiffness), dtype=upper.indices.dtype)
    indices[stiffness] = number[upper.indices[kept]]
    indices[row_places] = n + transposed.indices
    indices[len(stiffness) - r :] = np.arange(n, n + r)
    key = (upper.indptr, upper.indices, free, rows.indptr, rows.indices)
    pattern = _Pattern(key, kept, stiffness, row_places, transposed.data)
    return pattern, sp.csr_matrix((pattern.values(upper, rows), indices, indptr), shape=(n + r, n + r))


def _superlu(upper: sp.csr_matrix, rows: sp.csr_matrix) -> tuple[Float, int, Callable[[Float], Float]]:
    from scipy.sparse.linalg import splu

    full = (upper + sp.triu(upper, 1).T).tocsc()
    factor = splu(full, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    compliance = np.empty((rows.shape[0], rows.shape[0]))
    for start in range(0, rows.shape[0], _SOLVE_CHUNK):
        part = slice(start, start + _SOLVE_CHUNK)
        compliance[:, part] = rows @ factor.solve(rows[part].T.toarray())
    return compliance, 0, factor.solve
