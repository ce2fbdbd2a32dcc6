"""Directions of contact points."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.directions import bases_of
from finger3d.objects import vertical_frame


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
