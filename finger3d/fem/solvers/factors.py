"""Factors of the stiffness of a body with rows: those that give whole solutions only, and that of SuperLU."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

_ROWS_AT_ONCE = 64


class WholeSolutions(ABC):
    """Factor of a stiffness K (n, n) with rows R (r, n) that eliminates loads by whole solutions."""

    rows: sp.csr_matrix

    @abstractmethod
    def solve(self, load: Float) -> Float:
        """Return ``K^-1 load`` (n, m)."""

    def eliminated(self, load: Float) -> tuple[Float, Float]:
        """Return what `substituted` takes, here ``K^-1 load`` (n, m), and ``R K^-1 load`` (r, m), of loads (n, m)."""
        solution = self.solve(load)
        return solution, self.rows @ solution

    def substituted(self, eliminated: Float | None, force: Float) -> Float:
        """Return ``K^-1 (load + R^T force)`` (n, m) for loads eliminated, if any, and forces (r, m)."""
        if eliminated is not None and not force.any():
            return eliminated
        solution = self.solve(self.rows.T @ force)
        return solution if eliminated is None else eliminated + solution


@dataclass(frozen=True)
class SuperLUFactor(WholeSolutions):
    """SuperLU's factor of a stiffness, and rows."""

    factor: SuperLU
    rows: sp.csr_matrix

    @classmethod
    def of(cls, upper: sp.csr_matrix, rows: sp.csr_matrix) -> SuperLUFactor:
        """Factor a stiffness, of which the upper triangle is given."""
        from scipy.sparse.linalg import splu

        full = (upper + sp.triu(upper, 1).T).tocsc()
        return cls(splu(full, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}), rows)

    def solve(self, load: Float) -> Float:
        """See `WholeSolutions`."""
        return np.asarray(self.factor.solve(load))

    def compliance(self) -> Float:
        """Return ``R K^-1 R^T`` (r, r)."""
        compliance = np.empty((self.rows.shape[0], self.rows.shape[0]))
        for start in range(0, len(compliance), _ROWS_AT_ONCE):
            part = slice(start, start + _ROWS_AT_ONCE)
            compliance[:, part] = self.rows @ self.solve(self.rows[part].T.toarray())
        return compliance
