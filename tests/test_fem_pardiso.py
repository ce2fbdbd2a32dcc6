"""Factors by PARDISO."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.fem import pardiso
from finger3d.fem.assembly import stiffness
from finger3d.fem.condense import condense
from finger3d.fem.material import Elasticity
from finger3d.fem.pardiso import available
from finger3d.fem.simplex import quadratic
from finger3d.fem.traces import local_rows, strain_row, surface
from finger3d.objects import vertical_frame
from tests.meshes import grid


@pytest.mark.skipif(not pardiso.available(), reason="no MKL")
def test_a_factor_without_memory_is_a_lack_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    import numpy as np
    import scipy.sparse as sp

    def refuses(*arguments: object) -> None:
        phase = arguments[4]._obj.value
        arguments[-1]._obj.value = -2 if phase == 22 else 0  # PARDISO's number for it

    monkeypatch.setattr(pardiso, "_library", lambda: refuses)
    with pytest.raises(MemoryError):
        pardiso.SchurFactor(sp.csr_matrix(np.eye(3)), 1)


def setup(nu: float, dim: int = 3):
    mesh = quadratic(grid((3,) * dim, 0.2))
    held = np.unique(mesh.facets["y-"])
    fixed = (held[:, None] * dim + np.arange(dim)).ravel()
    top = surface(mesh, "y+")
    rows = sp.vstack([local_rows(top, vertical_frame(dim)), strain_row(mesh, np.full(dim, 0.4), np.eye(dim)[0])])
    return mesh, stiffness(mesh, Elasticity.of(1.0, nu)), fixed, sp.csr_matrix(rows)


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
