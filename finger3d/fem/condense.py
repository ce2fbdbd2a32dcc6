"""Condensation of a body to a few rows of interest: one factorisation, one small dense compliance.

PARDISO returns ``R K^-1 R^T`` as a Schur complement for about the price of factoring K (design.md sec. 1); where there
is no MKL, SuperLU factors K and solves for every row, behind the same interface.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d.fem.assembly import Stiffness

Float = NDArray[np.float64]
Int = NDArray[np.int64]

_SOLVE_CHUNK = 64


@dataclass(frozen=True)
class Condensed:
    """A body seen through its rows.

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

    def unknowns(self, force: Float) -> Float:
        """All unknowns (N,) under row forces (r,) N, with the factor at hand: displacements mm, then pressures."""
        return self.solve(self._rows.T @ force)

    def solve(self, load: Float) -> Float:
        """All unknowns (N,) under loads (N,) on any of them; held ones stay zero."""
        whole = np.zeros(self._rows.shape[1])
        whole[self._free] = self._solve(load[self._free])
        return whole

    def read(self, unknowns: Float) -> Float:
        """Row displacements (r,) mm of all unknowns (N,)."""
        return np.asarray(self._rows @ unknowns)

    def again(self, stiffness: Stiffness) -> Condensed:
        """Another stiffness on the same numbering, held and condensed alike: one more factorisation."""
        fixed = np.setdiff1d(np.arange(self._rows.shape[1]), self._free)
        return condense(stiffness, fixed, self._rows, self.solver)


def condense(stiffness: Stiffness, fixed: Int, rows: sp.csr_matrix, solver: str | None = None) -> Condensed:
    """Condense a stiffness to rows.

    Parameters
    ----------
    stiffness : upper triangle (N, N)
    fixed : numbers of the unknowns held at zero
    rows : (r, n d) sparse
        What is read: row displacement = rows @ u; row forces act through the transpose.
    solver : "pardiso" or "superlu"; default FINGER3D_SOLVER, else PARDISO where it is installed
    """
    start = time.perf_counter()
    size = stiffness.upper.shape[0]
    keep = np.ones(size, dtype=bool)
    keep[fixed] = False
    free = np.flatnonzero(keep)
    upper = stiffness.upper[free][:, free]
    padded = sp.csr_matrix((rows.data, rows.indices, rows.indptr), shape=(rows.shape[0], size))
    reduced = padded[:, free].tocsr()
    solver = solver or os.environ.get("FINGER3D_SOLVER") or _default_solver()
    build = {"pardiso": _pardiso, "superlu": _superlu}[solver]
    compliance, perturbed, solve = build(upper, reduced)
    compliance = 0.5 * (compliance + compliance.T)
    seconds = time.perf_counter() - start
    return Condensed(compliance, perturbed, 1, seconds, solver, padded, free, solve)


def spring_forces(compliance: Float, springs: Float, moved: Float) -> Float:
    """Forces (s, ...) N of springs (s,) N/mm on the last s rows of a body, which without them would move by `moved`.

    Woodbury's formula: with any number of springs on its rows a body keeps its factorisation.
    """
    first = len(compliance) - len(springs)
    root = np.sqrt(springs)
    inner = np.eye(len(springs)) + root[:, None] * compliance[first:, first:] * root
    scaled = (root * moved[first:].T).T
    return -(root * np.linalg.solve(inner, scaled).T).T


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


def _pardiso(upper: sp.csr_matrix, rows: sp.csr_matrix) -> tuple[Float, int, Callable[[Float], Float]]:
    from finger3d.fem.pardiso import SchurFactor

    n, r = upper.shape[0], rows.shape[0]
    k, b = upper.tocoo(), rows.tocoo()
    last = n + np.arange(r)
    data = np.concatenate([k.data, b.data, np.zeros(r)])
    i = np.concatenate([k.row, b.col, last])
    j = np.concatenate([k.col, n + b.row, last])
    factor = SchurFactor(sp.csr_matrix((data, (i, j)), shape=(n + r, n + r)), r)
    return -factor.schur, factor.perturbed, factor.solve


def _superlu(upper: sp.csr_matrix, rows: sp.csr_matrix) -> tuple[Float, int, Callable[[Float], Float]]:
    from scipy.sparse.linalg import splu

    full = (upper + sp.triu(upper, 1).T).tocsc()
    factor = splu(full, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    compliance = np.empty((rows.shape[0], rows.shape[0]))
    for start in range(0, rows.shape[0], _SOLVE_CHUNK):
        part = slice(start, start + _SOLVE_CHUNK)
        compliance[:, part] = rows @ factor.solve(rows[part].T.toarray())
    return compliance, 0, factor.solve
