"""Loads and row forces eliminated by whole solutions."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.fem.solvers.factors import WholeSolutions

STIFFNESS = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 1.0], [0.0, 1.0, 2.0]])


class Dense(WholeSolutions):
    def __init__(self) -> None:
        self.rows, self.solved = sp.csr_matrix([[1.0, 0.0, 2.0]]), 0

    def solve(self, load: np.ndarray) -> np.ndarray:
        self.solved += 1
        return np.linalg.solve(STIFFNESS, load)


def test_loads_and_row_forces_add() -> None:
    factor, load, force = Dense(), np.array([[1.0], [2.0], [3.0]]), np.array([[5.0]])
    eliminated, moved = factor.eliminated(load)
    assert moved == pytest.approx(factor.rows @ np.linalg.solve(STIFFNESS, load))
    wanted = np.linalg.solve(STIFFNESS, load + factor.rows.T @ force)
    assert factor.substituted(eliminated, force) == pytest.approx(wanted)
    assert factor.substituted(None, force) == pytest.approx(np.linalg.solve(STIFFNESS, factor.rows.T @ force))


def test_without_row_forces_nothing_is_solved_again() -> None:
    factor = Dense()
    eliminated, _ = factor.eliminated(np.ones((3, 2)))
    assert factor.substituted(eliminated, np.zeros((1, 2))) is eliminated
    assert factor.solved == 1
