"""Determinants and cofactors of many 3 x 3 tensors, by explicit formulas: LAPACK takes several times as long."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float


class InvertedError(ArithmeticError):
    """A cell is inverted, or deformed beyond what a law can be evaluated at: the increment is too large."""


def determinant(f: Float) -> Float:
    """Return the determinants (...,) of tensors (..., 3, 3)."""
    return np.asarray(
        f[..., 0, 0] * (f[..., 1, 1] * f[..., 2, 2] - f[..., 1, 2] * f[..., 2, 1])
        - f[..., 0, 1] * (f[..., 1, 0] * f[..., 2, 2] - f[..., 1, 2] * f[..., 2, 0])
        + f[..., 0, 2] * (f[..., 1, 0] * f[..., 2, 1] - f[..., 1, 1] * f[..., 2, 0])
    )


def cofactor(f: Float) -> Float:
    """Return the cofactors (..., 3, 3) of tensors, det(F) F^-T."""
    out = np.empty_like(f)
    for i in range(3):
        p, q = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            r, s = (j + 1) % 3, (j + 2) % 3
            out[..., i, j] = f[..., p, r] * f[..., q, s] - f[..., p, s] * f[..., q, r]
    return out
