"""Condensation of a body to some rows of its displacements: one factorisation, and a dense compliance.

PARDISO and MUMPS return ``R K^-1 R^T`` as a Schur complement at about the cost of factoring K.  Where neither is
installed, SuperLU factors K and solves for every row.
"""

from __future__ import annotations

import itertools
import math
import os
import time
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float, Int, freeze_arrays
from finger3d.fem.assembly import Stiffness
from finger3d.fem.solvers.factors import SuperLUFactor

if TYPE_CHECKING:
    from finger3d.fem.solvers import mumps, pardiso


@dataclass(frozen=True)
class Condensation:
    """A body condensed to its rows.

    Attributes
    ----------
    compliance : (r, r) mm/N
        Row displacements per unit row force, symmetric: ``R K^-1 R^T``.
    rows : (r, N) sparse
        Rows that the body is condensed to.
    perturbed_pivots : int
        Number of pivots that PARDISO replaced; 0 if the factor is accurate.
    """

    compliance: Float
    perturbed_pivots: int
    factorizations: int
    seconds: float
    solver: str
    rows: sp.csr_matrix = field(repr=False)
    _free: Int = field(repr=False)
    _factor: _Augmented | SuperLUFactor = field(repr=False)
    _scale: float = field(repr=False)  # of the stiffness, as it was factored
    _row_scales: Float = field(repr=False)

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def unknowns(self, force: Float) -> Float:
        """Return all unknowns (N, ...) under forces (k, ...), N, on the first rows: displacements (mm), then pressures.

        Several forces in the columns of an array (r, k) cost less than one after another.
        """
        return self._substituted(None, force)

    def solve(self, load: Float) -> Float:
        """Return all unknowns (N, ...) under loads (N, ...); fixed unknowns are zero."""
        return self.eliminated(load).unknowns(np.zeros((self.rows.shape[0], *load.shape[1:])))

    def eliminated(self, load: Float) -> Elimination:
        """Eliminate the unknowns under loads (N, ...): the first half of a solution, which gives the rows."""
        columns = load[self._free].reshape(len(self._free), -1)
        eliminated, displacement = self._factor.eliminated(columns)
        scaled = self._row_scales[:, None] * displacement / self._scale
        return Elimination(scaled.reshape(-1, *load.shape[1:]), self, eliminated)

    def _substituted(self, eliminated: Float | None, force: Float) -> Float:
        columns = force.reshape(len(force), -1)
        columns = np.vstack([columns, np.zeros((len(self._row_scales) - len(force), columns.shape[1]))])
        columns *= self._row_scales[:, None]
        whole = np.zeros((self.rows.shape[1], columns.shape[1]), order="F")  # one field after another
        whole[self._free] = self._factor.substituted(eliminated, columns) / self._scale
        return whole.reshape(-1, *force.shape[1:], order="A")

    def read(self, unknowns: Float) -> Float:
        """Return the row displacements (r,), mm, of all unknowns (N,)."""
        return np.asarray(self.rows @ unknowns)

    def again(self, stiffness: Stiffness) -> Condensation:
        """Condense another stiffness with the same fixed unknowns and rows; this takes one more factorisation."""
        fixed = np.setdiff1d(np.arange(self.rows.shape[1]), self._free)
        return condense(stiffness, fixed, self.rows, self.solver)


@dataclass(frozen=True)
class Elimination:
    """A condensed body under loads whose row forces are not known yet.

    Attributes
    ----------
    displacement : (r, ...) mm
        Of the rows under the loads alone.
    """

    displacement: Float
    _body: Condensation = field(repr=False)
    _eliminated: Float = field(repr=False)

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def unknowns(self, force: Float) -> Float:
        """Return all unknowns (N, ...) under the loads and forces (k, ...), N, on the first rows."""
        return self._body._substituted(self._eliminated, force)


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
    solver : "pardiso", "mumps" or "superlu"; default FINGER3D_SOLVER, else the first of them that is installed
    replaced : a condensed body that is no longer needed
        If it has the same sparsity pattern, its ordering is kept and its factor overwritten; that body keeps its
        compliance, but can no longer solve.
    """
    start = time.perf_counter()
    upper = stiffness.upper
    size = upper.shape[0]
    if not upper.has_sorted_indices:
        upper = upper.sorted_indices()
    solver = solver or os.environ.get("FINGER3D_SOLVER") or default_solver()
    keep = np.ones(size, dtype=bool)
    keep[fixed] = False
    free = np.flatnonzero(keep)
    padded = sp.csr_matrix((rows.data, rows.indices, rows.indptr), shape=(rows.shape[0], size))
    # PARDISO perturbs pivots below 1e-13 of the largest entry of [[K, R^T], [R, 0]]: K and every row of R are scaled to
    # entries of order 1, by powers of two, so that neither the modulus nor the unit of a row changes a digit.
    unit = _power_of_two(upper.data)
    units = _row_scales(padded)
    scaled = sp.csr_matrix((upper.data / unit, upper.indices, upper.indptr), shape=upper.shape)
    entries = padded.data / np.repeat(units, np.diff(padded.indptr))
    read = sp.csr_matrix((entries, padded.indices, padded.indptr), shape=padded.shape)
    factor: _Augmented | SuperLUFactor
    if solver in ("pardiso", "mumps"):
        before = replaced._factor if replaced and replaced.solver == solver else None
        factor = _Augmented.of(solver, scaled, free, read, before if isinstance(before, _Augmented) else None)
        schur, perturbed = factor.factor.schur, factor.factor.perturbed
    else:
        factor = SuperLUFactor.of(scaled[free][:, free], read[:, free].tocsr())
        schur, perturbed = -factor.compliance(), 0
    compliance = schur + schur.T  # scaled in place: with 10 000 rows each copy takes 0.8 GB
    compliance *= (-0.5 / unit) * units[:, None]
    compliance *= units
    seconds = time.perf_counter() - start
    return Condensation(compliance, perturbed, 1, seconds, solver, padded, free, factor, unit, units)


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
    reduced = compliance + compliance[:, first:] @ spring_forces(compliance, springs, compliance)
    return 0.5 * (reduced + reduced.T)


def is_installed(solver: str) -> bool:
    """Return whether the library of "pardiso" or "mumps" can be loaded on this machine."""
    try:
        import_module(f"finger3d.fem.solvers.{solver}").library()
    except (ImportError, OSError):
        return False
    return True


def default_solver() -> str:
    """Return the first solver that is installed: "pardiso", "mumps" or "superlu"."""
    return next(filter(is_installed, ("pardiso", "mumps")), "superlu")


@dataclass(frozen=True)
class _Pattern:
    """Sparsity pattern of the augmented matrix ``[[K, R^T], [R, 0]]`` of the free unknowns.

    Attributes
    ----------
    key : index arrays of stiffness and rows; the same arrays give the same pattern
    is_kept : (nnz of the stiffness,) whether both unknowns of an entry are free
    is_stiffness : (nnz of the augmented matrix,) whether an entry is one of the stiffness
    row_places, row_entries : places of the entries of the rows, and which entries these are
    """

    key: tuple[Int, ...]
    is_kept: NDArray[np.bool_]
    is_stiffness: NDArray[np.bool_]
    row_places: Int
    row_entries: Int

    def values(self, upper: sp.csr_matrix, rows: sp.csr_matrix) -> Float:
        """Return the entries (nnz,) of the augmented matrix."""
        entries = np.zeros(len(self.is_stiffness))
        entries[self.is_stiffness] = upper.data[self.is_kept]
        entries[self.row_places] = rows.data[self.row_entries]
        return entries


@dataclass(frozen=True)
class _Augmented:
    """Factor of one augmented matrix by PARDISO or MUMPS; a later matrix of the same pattern may overwrite it.

    `number` counts the matrices that this factor has been computed for.
    """

    pattern: _Pattern
    factor: pardiso.PardisoFactor | mumps.MumpsFactor
    number: int = 1

    @property
    def is_current(self) -> bool:
        """Whether the factor is still that of this matrix."""
        return self.number == self.factor.factorizations

    def eliminated(self, load: Float) -> tuple[Float, Float]:
        """See `WholeSolutions`; PARDISO leaves the solution to `substituted`."""
        return self._current().eliminated(load)

    def substituted(self, eliminated: Float | None, force: Float) -> Float:
        """See `WholeSolutions`."""
        return self._current().substituted(eliminated, force)

    def _current(self) -> pardiso.PardisoFactor | mumps.MumpsFactor:
        if not self.is_current:
            raise RuntimeError("the factor of this condensed body was overwritten by a later one; condense it again")
        return self.factor

    @classmethod
    def of(
        cls, solver: str, upper: sp.csr_matrix, free: Int, rows: sp.csr_matrix, replaced: _Augmented | None
    ) -> _Augmented:
        """Factor the matrix of the free unknowns and the rows, reusing an earlier factor of the same pattern."""
        from finger3d.fem.solvers import mumps, pardiso

        key = (upper.indptr, upper.indices, free, rows.indptr, rows.indices)
        if replaced and replaced.is_current and all(map(np.array_equal, key, replaced.pattern.key)):
            replaced.factor.renew(replaced.pattern.values(upper, rows))
            return cls(replaced.pattern, replaced.factor, replaced.factor.factorizations)
        pattern, matrix = _augmented(upper, free, rows)
        factor = mumps.MumpsFactor if solver == "mumps" else pardiso.PardisoFactor
        return cls(pattern, factor(matrix, rows.shape[0]))


def _augmented(upper: sp.csr_matrix, free: Int, rows: sp.csr_matrix) -> tuple[_Pattern, sp.csr_matrix]:
    """Return the upper triangle of ``[[K, R^T], [R, 0]]``; in each row the entries of R^T follow those of K."""
    n, r = len(free), rows.shape[0]
    is_free = np.zeros(upper.shape[0], dtype=np.bool_)
    is_free[free] = True
    kept = is_free[upper.indices]
    kept &= np.repeat(is_free, np.diff(upper.indptr))
    row_lengths = np.add.reduceat(kept, upper.indptr[:-1], dtype=np.int64)[free]  # no row is empty: it has its diagonal
    numbered = sp.csr_matrix((np.arange(rows.nnz), rows.indices, rows.indptr), rows.shape)
    transposed = numbered[:, free].T.tocsr()
    more = np.diff(transposed.indptr)
    indptr = np.concatenate([[0], np.cumsum(np.concatenate([row_lengths + more, np.ones(r, dtype=np.int64)]))])
    row_places = np.arange(transposed.nnz) + np.repeat(np.cumsum(row_lengths), more)
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
