"""Condensation: the Schur complement is R K^-1 R^T, by either solver, and gives the field back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.fem.solvers.condense import condense
from tests.meshes import SOLVERS, held_cube


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
@pytest.mark.parametrize("solver", SOLVERS)
def test_compliance_equals_a_dense_inverse(nu: float, solver: str) -> None:
    mesh, matrix, fixed, rows = held_cube(nu)
    full = (matrix.upper + sp.triu(matrix.upper, 1).T).toarray()
    free = np.setdiff1d(np.arange(len(full)), fixed)
    r = np.zeros((rows.shape[0], len(full)))
    r[:, : rows.shape[1]] = rows.toarray()
    want = r[:, free] @ np.linalg.solve(full[np.ix_(free, free)], r[:, free].T)
    found = condense(matrix, fixed, rows, solver)
    assert found.perturbed_pivots == 0
    # at nu = 0.5 the floor of the compressibility, 1e-7 / G, costs both solutions that many digits
    assert np.abs(found.compliance - want).max() < (1e-12 if nu < 0.5 else 1e-9) * np.abs(want).max()


@pytest.mark.parametrize("solver", SOLVERS)
def test_field_follows_from_the_same_factor(solver: str) -> None:
    mesh, matrix, fixed, rows = held_cube(0.3)
    found = condense(matrix, fixed, rows, solver)
    force = np.random.default_rng(0).normal(size=rows.shape[0])
    u = found.unknowns(force)
    assert np.abs(rows @ u[: rows.shape[1]] - found.compliance @ force).max() < 1e-11
    assert np.all(u[fixed] == 0.0)


@pytest.mark.parametrize("columns", [(), (3,)])
@pytest.mark.parametrize("solver", SOLVERS)
def test_elimination_gives_the_rows_before_their_forces_are_known(solver: str, columns: tuple[int, ...]) -> None:
    """Against one solution with loads and row forces together, with a modulus that scales the matrix."""
    mesh, matrix, fixed, rows = held_cube(0.49)
    found = condense(replace(matrix, upper=1e5 * matrix.upper), fixed, rows, solver)
    random = np.random.default_rng(0)
    load, force = (random.normal(size=(n, *columns)) for n in (matrix.upper.shape[0], rows.shape[0]))
    padded = sp.csr_matrix((rows.data, rows.indices, rows.indptr), (rows.shape[0], len(load)))
    eliminated, alone = found.eliminated(load), found.solve(load)
    assert eliminated.displacement == pytest.approx(padded @ alone, rel=1e-9, abs=1e-12 * np.abs(alone).max())
    want = found.solve(load + padded.T @ force)
    assert eliminated.unknowns(force).shape == load.shape
    assert np.abs(eliminated.unknowns(force) - want).max() < 1e-11 * np.abs(want).max()
