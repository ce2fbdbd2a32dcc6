"""Condensation: the Schur complement is R K^-1 R^T, by either solver, and gives the field back."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.fem.assembly import stiffness
from finger3d.fem.condense import condense
from finger3d.fem.material import Elasticity
from finger3d.fem.pardiso import available
from finger3d.fem.simplex import quadratic
from finger3d.fem.traces import displacement_row, local_rows, strain_row, surface
from finger3d.objects import vertical_frame
from tests.meshes import grid


def setup(nu: float, dim: int = 3):
    mesh = quadratic(grid((3,) * dim, 0.2))
    held = np.unique(mesh.facets["y-"])
    fixed = (held[:, None] * dim + np.arange(dim)).ravel()
    top = surface(mesh, "y+")
    rows = sp.vstack([local_rows(top, vertical_frame(dim)), strain_row(mesh, np.full(dim, 0.4), np.eye(dim)[0])])
    return mesh, stiffness(mesh, Elasticity.of(1.0, nu)), fixed, sp.csr_matrix(rows)


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
@pytest.mark.parametrize("solver", ["superlu", *(["pardiso"] if available() else [])])
def test_compliance_equals_a_dense_inverse(nu: float, solver: str) -> None:
    mesh, matrix, fixed, rows = setup(nu)
    full = (matrix.upper + sp.triu(matrix.upper, 1).T).toarray()
    free = np.setdiff1d(np.arange(len(full)), fixed)
    r = np.zeros((rows.shape[0], len(full)))
    r[:, : rows.shape[1]] = rows.toarray()
    want = r[:, free] @ np.linalg.solve(full[np.ix_(free, free)], r[:, free].T)
    found = condense(matrix, fixed, rows, solver)
    assert found.perturbed_pivots == 0
    # at nu = 0.5 the floor of the compressibility, 1e-7 / G, costs both solutions that many digits
    assert np.abs(found.compliance - want).max() < (1e-12 if nu < 0.5 else 1e-9) * np.abs(want).max()


@pytest.mark.parametrize("solver", ["superlu", *(["pardiso"] if available() else [])])
def test_field_follows_from_the_same_factor(solver: str) -> None:
    mesh, matrix, fixed, rows = setup(0.3)
    found = condense(matrix, fixed, rows, solver)
    force = np.random.default_rng(0).normal(size=rows.shape[0])
    u = found.unknowns(force)
    assert np.abs(rows @ u[: rows.shape[1]] - found.compliance @ force).max() < 1e-11
    assert np.all(u[fixed] == 0.0)


@pytest.mark.parametrize("columns", [(), (3,)])
@pytest.mark.parametrize("solver", ["superlu", *(["pardiso"] if available() else [])])
def test_elimination_gives_the_rows_before_their_forces_are_known(solver: str, columns: tuple[int, ...]) -> None:
    """Against one solution with loads and row forces together, with a modulus that scales the matrix."""
    mesh, matrix, fixed, rows = setup(0.49)
    found = condense(replace(matrix, upper=1e5 * matrix.upper), fixed, rows, solver)
    random = np.random.default_rng(0)
    load, force = (random.normal(size=(n, *columns)) for n in (matrix.upper.shape[0], rows.shape[0]))
    padded = sp.csr_matrix((rows.data, rows.indices, rows.indptr), (rows.shape[0], len(load)))
    eliminated, alone = found.eliminated(load), found.solve(load)
    assert eliminated.displacement == pytest.approx(padded @ alone, rel=1e-9, abs=1e-12 * np.abs(alone).max())
    want = found.solve(load + padded.T @ force)
    assert eliminated.unknowns(force).shape == load.shape
    assert np.abs(eliminated.unknowns(force) - want).max() < 1e-11 * np.abs(want).max()


@pytest.mark.parametrize("solver", ["superlu", *(["pardiso"] if available() else [])])
def test_a_body_never_solves_with_the_factor_of_a_later_one(solver: str) -> None:
    """Twice the stiffness halves the displacements; the overwritten body may refuse, never answer for the other."""
    mesh, matrix, fixed, rows = setup(0.3)
    load = np.random.default_rng(0).normal(size=matrix.upper.shape[0])
    first = condense(matrix, fixed, rows, solver)
    before = first.solve(load)
    twice = replace(matrix, upper=2.0 * matrix.upper)
    second = condense(twice, fixed, rows, solver, replaced=first)
    assert np.abs(second.solve(load) - 0.5 * before).max() < 1e-12 * np.abs(before).max()
    assert np.array_equal(first.compliance, 2.0 * second.compliance)
    with pytest.raises(RuntimeError) if solver == "pardiso" else nullcontext():
        assert np.array_equal(first.solve(load), before)
    third = condense(matrix, fixed, rows, solver, replaced=first)  # its factor is the second's by now
    assert np.abs(third.solve(load) - before).max() < 1e-12 * np.abs(before).max()
    assert np.abs(second.solve(load) - 0.5 * before).max() < 1e-12 * np.abs(before).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_traces_and_strains_read_a_linear_field_exactly(dim: int) -> None:
    mesh = quadratic(grid((3,) * dim, 0.2))
    slope = np.random.default_rng(1).normal(size=(dim, dim))
    u = mesh.points @ slope.T
    top = surface(mesh, "y+", thickness=2.0)
    assert top.area.sum() == pytest.approx(2.0, rel=1e-13)
    centre = top.average @ top.samples  # the hat's centre of gravity, where a weighted mean of a linear field is read
    assert np.abs(top.trace @ u - centre @ slope.T).max() < 1e-13
    direction = np.eye(dim)[0] * 0.6 + np.eye(dim)[1] * 0.8
    point = np.full(dim, 1 / 3)  # on a shared facet
    assert (strain_row(mesh, point, direction) @ u.ravel())[0] == pytest.approx(
        direction @ slope @ direction, abs=1e-12
    )
    assert (displacement_row(mesh, point, direction) @ u.ravel())[0] == pytest.approx(
        direction @ slope @ point, abs=1e-12
    )
