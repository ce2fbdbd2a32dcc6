"""Factors by MUMPS."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.fem.solvers import mumps
from finger3d.fem.solvers.condense import condense
from tests.meshes import held_cube

pytestmark = pytest.mark.skipif(not mumps.available(), reason="needs the extra mumps")


def random_matrix(n: int, seed: int) -> np.ndarray:
    """Symmetric, indefinite and well conditioned."""
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.normal(size=(n, n)))
    return turn @ np.diag(random.uniform(1.0, 2.0, n) * np.where(np.arange(n) % 3, 1.0, -1.0)) @ turn.T


def test_the_schur_complement_of_an_indefinite_matrix_is_that_of_its_inverse() -> None:
    stiffness, rows = random_matrix(40, 0), np.random.default_rng(1).normal(size=(7, 40))
    augmented = np.block([[stiffness, rows.T], [rows, np.zeros((7, 7))]])
    factor = mumps.MumpsFactor(sp.csr_matrix(np.triu(augmented)), 7)
    assert factor.schur == pytest.approx(-rows @ np.linalg.solve(stiffness, rows.T), rel=1e-10, abs=1e-12)
    load, force = np.random.default_rng(2).normal(size=(40, 100)), np.random.default_rng(3).normal(size=(7, 100))
    found = factor.substituted(factor.eliminated(load)[0], force)
    assert found == pytest.approx(np.linalg.solve(stiffness, load + rows.T @ force), rel=1e-9, abs=1e-11)


def test_a_renewed_factor_is_that_of_the_new_matrix() -> None:
    first, second = (sp.csr_matrix(np.triu(random_matrix(20, seed))) for seed in (0, 1))
    factor = mumps.MumpsFactor(first, 4)
    factor.renew(second.data)
    assert factor.factorizations == 2
    fresh = mumps.MumpsFactor(second, 4)
    assert np.array_equal(factor.schur, fresh.schur)
    force = np.arange(1.0, 5.0)[:, None]
    assert np.array_equal(factor.substituted(None, force), fresh.substituted(None, force))


def test_a_body_that_is_not_held_has_a_perturbed_pivot_for_every_rigid_motion() -> None:
    _, matrix, _, rows = held_cube(0.3)
    assert condense(matrix, np.array([], dtype=np.int64), rows, "mumps").perturbed_pivots == 6


def test_what_mumps_refuses_is_told_with_the_number_of_the_error() -> None:
    with pytest.raises(mumps.MumpsError, match=r"error -\d+"):
        mumps.MumpsFactor(sp.csr_matrix(np.eye(3)), 3)  # nothing is left to eliminate


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


def test_a_header_of_another_form_is_an_import_error() -> None:
    with pytest.raises(ImportError):
        mumps._declarations("typedef struct { int n; } OTHER;")


def test_the_declarations_hold_every_field_of_the_header() -> None:
    from importlib.util import find_spec

    header = Path(find_spec("casadi").origin).parent / "include" / "coin-or" / "mumps" / "dmumps_c.h"
    found = mumps._declarations(header.read_text())
    assert "/*" not in found
    assert "#" not in found
    for field in ("icntl[60]", "version_number[30 + 1 + 1]", "instance_number", "size_schur"):
        assert field in found
