"""Factors by PARDISO."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.fem.solvers import pardiso
from finger3d.fem.solvers.condense import condense
from tests.meshes import SOLVERS, held_cube


@pytest.mark.skipif(not pardiso.available(), reason="no MKL")
def test_a_factor_without_memory_is_a_lack_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*arguments: object) -> None:
        phase = arguments[4]._obj.value
        arguments[-1]._obj.value = -2 if phase == 22 else 0  # PARDISO's number for it

    monkeypatch.setattr(pardiso, "_library", lambda: (refuses, lambda count: 0, 1))
    with pytest.raises(MemoryError):
        pardiso.PardisoFactor(sp.csr_matrix(np.eye(3)), 1)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_body_never_solves_with_the_factor_of_a_later_one(solver: str) -> None:
    """Twice the stiffness halves the displacements; the overwritten body may refuse, never answer for the other."""
    mesh, matrix, fixed, rows = held_cube(0.3)
    load = np.random.default_rng(0).normal(size=matrix.upper.shape[0])
    first = condense(matrix, fixed, rows, solver)
    before = first.solve(load)
    twice = replace(matrix, upper=2.0 * matrix.upper)
    second = condense(twice, fixed, rows, solver, replaced=first)
    assert np.abs(second.solve(load) - 0.5 * before).max() < 1e-12 * np.abs(before).max()
    assert np.array_equal(first.compliance, 2.0 * second.compliance)
    with nullcontext() if solver == "superlu" else pytest.raises(RuntimeError):
        assert np.array_equal(first.solve(load), before)
    third = condense(matrix, fixed, rows, solver, replaced=first)  # its factor is the second's by now
    assert np.abs(third.solve(load) - before).max() < 1e-12 * np.abs(before).max()
    assert np.abs(second.solve(load) - 0.5 * before).max() < 1e-12 * np.abs(before).max()
