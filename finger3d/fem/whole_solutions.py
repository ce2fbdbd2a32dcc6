"""Elimination of loads by whole solutions, for a factor without separate forward and backward substitutions."""

from __future__ import annotations

from abc import ABC, abstractmethod

import scipy.sparse as sp

from finger3d._types import Float


class WholeSolutions(ABC):
    """Factor of a stiffness K (n, n) with rows R (r, n) that offers full solutions only."""

    rows: sp.csr_matrix

    @abstractmethod
    def solve(self, load: Float) -> Float:
        """Return ``K^-1 load`` (n, m)."""

    def eliminated(self, load: Float) -> tuple[Float, Float]:
        """Return ``K^-1 load`` (n, m) and ``R K^-1 load`` (r, m) of loads (n, m)."""
        solution = self.solve(load)
        return solution, self.rows @ solution

    def substituted(self, eliminated: Float | None, force: Float) -> Float:
        """Return ``K^-1 (load + R^T force)`` (n, m) for loads eliminated, if any, and forces (r, m)."""
        if eliminated is not None and not force.any():
            return eliminated
        solution = self.solve(self.rows.T @ force)
        return solution if eliminated is None else eliminated + solution
