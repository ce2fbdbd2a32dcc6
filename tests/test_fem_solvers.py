"""Condensation by every solver that is installed, and the factors behind it."""

from __future__ import annotations

import gc
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.errors import MissingError
from finger3d.fem.solvers import mumps, pardiso
from finger3d.fem.solvers.condense import condense, is_installed
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
    pushed = found.unknowns(force)
    assert not pushed[fixed].any()
    assert np.abs(found.solve(padded.T @ force) - pushed).max() < 1e-11 * np.abs(pushed).max()
    want = found.solve(load + padded.T @ force)
    assert eliminated.unknowns(force).shape == load.shape
    assert np.abs(eliminated.unknowns(force) - want).max() < 1e-11 * np.abs(want).max()


needs_mumps = pytest.mark.skipif(not is_installed("mumps"), reason="needs the extra mumps")


def random_matrix(n: int, seed: int) -> np.ndarray:
    """Symmetric, indefinite and well conditioned."""
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.normal(size=(n, n)))
    return turn @ np.diag(random.uniform(1.0, 2.0, n) * np.where(np.arange(n) % 3, 1.0, -1.0)) @ turn.T


@needs_mumps
def test_the_schur_complement_of_an_indefinite_matrix_is_that_of_its_inverse() -> None:
    stiffness, rows = random_matrix(40, 0), np.random.default_rng(1).normal(size=(7, 40))
    augmented = np.block([[stiffness, rows.T], [rows, np.zeros((7, 7))]])
    factor = mumps.MumpsFactor(sp.csr_matrix(np.triu(augmented)), 7)
    assert factor.schur == pytest.approx(-rows @ np.linalg.solve(stiffness, rows.T), rel=1e-10, abs=1e-12)
    load, force = np.random.default_rng(2).normal(size=(40, 100)), np.random.default_rng(3).normal(size=(7, 100))
    found = factor.substituted(factor.eliminated(load)[0], force)
    assert found == pytest.approx(np.linalg.solve(stiffness, load + rows.T @ force), rel=1e-9, abs=1e-11)


@needs_mumps
def test_a_renewed_factor_is_that_of_the_new_matrix() -> None:
    first, second = (sp.csr_matrix(np.triu(random_matrix(20, seed))) for seed in (0, 1))
    factor = mumps.MumpsFactor(first, 4)
    factor.renew(second.data)
    assert factor.factorizations == 2
    fresh = mumps.MumpsFactor(second, 4)
    assert np.array_equal(factor.schur, fresh.schur)
    force = np.arange(1.0, 5.0)[:, None]
    assert np.array_equal(factor.substituted(None, force), fresh.substituted(None, force))


@needs_mumps
def test_a_body_that_is_not_held_has_a_perturbed_pivot_for_every_rigid_motion() -> None:
    _, matrix, _, rows = held_cube(0.3)
    assert condense(matrix, np.array([], dtype=np.int64), rows, "mumps").perturbed_pivots == 6


@needs_mumps
def test_what_mumps_refuses_is_told_with_the_number_of_the_error() -> None:
    with pytest.raises(MissingError, match=r"error -\d+"):
        mumps.MumpsFactor(sp.csr_matrix(np.eye(3)), 3)  # nothing is left to eliminate


@needs_mumps
def test_bodies_that_share_the_library_do_not_disturb_each_other() -> None:
    _, matrix, fixed, rows = held_cube(0.3)
    load = np.random.default_rng(0).normal(size=matrix.upper.shape[0])
    first = condense(matrix, fixed, rows, "mumps")
    want = first.solve(load)
    other = condense(matrix, fixed, rows[:3], "mumps")
    assert np.allclose(other.solve(load), want, rtol=1e-9, atol=1e-12 * np.abs(want).max())
    del other
    gc.collect()
    assert np.array_equal(first.solve(load), want)


@pytest.mark.skipif(not is_installed("pardiso"), reason="no MKL")
def test_a_factor_without_memory_is_a_lack_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*arguments: object) -> None:
        phase = arguments[4]._obj.value
        arguments[-1]._obj.value = -2 if phase == 22 else 0  # PARDISO's number for it

    monkeypatch.setattr(pardiso, "library", lambda: (refuses, lambda count: 0, 1))
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
