"""Determinants and cofactors of tensors."""

from __future__ import annotations

import numpy as np

from finger3d.fem.tensors import cofactor, determinant


def test_they_are_those_of_linear_algebra_singular_tensors_included() -> None:
    f = np.random.default_rng(0).normal(size=(5, 4, 3, 3))
    assert np.allclose(determinant(f), np.linalg.det(f), rtol=1e-12)
    j = np.linalg.det(f)[..., None, None]
    assert np.allclose(cofactor(f), j * np.swapaxes(np.linalg.inv(f), -1, -2), rtol=1e-9)
    # a projection on a plane has no inverse; its cofactor projects on the normal
    assert np.array_equal(cofactor(np.diag([1.0, 1.0, 0.0])), np.diag([0.0, 0.0, 1.0]))
