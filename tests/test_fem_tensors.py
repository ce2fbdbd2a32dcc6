"""Determinants and cofactors of tensors."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.tensors import bases_of, cofactor, determinant, rotated_delassus
from finger3d.objects import vertical_frame
from tests.contact_cases import random_compliance


def test_they_are_those_of_linear_algebra_singular_tensors_included() -> None:
    f = np.random.default_rng(0).normal(size=(5, 4, 3, 3))
    assert np.allclose(determinant(f), np.linalg.det(f), rtol=1e-12)
    j = np.linalg.det(f)[..., None, None]
    assert np.allclose(cofactor(f), j * np.swapaxes(np.linalg.inv(f), -1, -2), rtol=1e-9)
    # a projection on a plane has no inverse; its cofactor projects on the normal
    assert np.array_equal(cofactor(np.diag([1.0, 1.0, 0.0])), np.diag([0.0, 0.0, 1.0]))


def unit_vectors(dim: int) -> np.ndarray:
    vectors = np.random.default_rng(1).normal(size=(50, dim))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


@pytest.mark.parametrize("dim", [2, 3])
def test_bases_are_orthonormal_and_begin_with_the_normal(dim: int) -> None:
    normal = np.vstack([unit_vectors(dim), np.eye(dim)[1], -np.eye(dim)[1]])
    bases = bases_of(normal)
    assert np.array_equal(bases[:, 0], normal)
    assert np.allclose(bases @ np.swapaxes(bases, 1, 2), np.eye(dim), atol=1e-12)
    assert np.allclose(bases[-1], vertical_frame(dim))
    # a rotation of the upright frame, not a reflection
    assert np.allclose(np.linalg.det(bases), np.linalg.det(vertical_frame(dim)))


def test_a_basis_is_turned_about_the_axis_across_both_normals() -> None:
    normal = unit_vectors(3)
    rotation = np.swapaxes(vertical_frame(3).T @ bases_of(normal), 1, 2)
    axis = np.cross([0.0, -1.0, 0.0], normal)
    assert np.allclose(np.einsum("cij,cj->ci", rotation, axis), axis, atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_turned_compliance_is_that_of_turned_vectors(dim: int) -> None:
    rng = np.random.default_rng(0)
    compliance = random_compliance(rng, 5, dim)
    turn = np.linalg.qr(rng.normal(size=(5, dim, dim)))[0]
    force = rng.normal(size=(5, dim))
    plain = np.einsum("idjk,jk->id", compliance, np.einsum("cki,ck->ci", turn, force))
    assert np.einsum("idjk,jk->id", rotated_delassus(compliance, turn), force) == pytest.approx(
        np.einsum("cik,ck->ci", turn, plain), rel=1e-10
    )
    assert rotated_delassus(compliance, np.tile(np.eye(dim), (5, 1, 1))) is compliance
    some = np.array([3, 0])
    of_some = rotated_delassus(compliance, turn[some], some)
    assert of_some == pytest.approx(rotated_delassus(compliance, turn)[np.ix_(some, range(dim), some, range(dim))])
