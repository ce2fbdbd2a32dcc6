"""Many small tensors: determinants and cofactors, bases of normals, and operators turned into them.

Explicit formulas are several times as fast as LAPACK.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int


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


_ROUND_OFF = 1e-13
"""Round-off of directions."""


LEAST_SLOPE = 0.1
"""Length of the mean of unit normals below which they oppose each other: the object is narrower than a hat."""


def unit_normals(normal: Float) -> Float:
    """Return unit vectors (c, d) along mean normals (c, d) of an object, -y where these are zero.

    A mean is zero where normals cancel: half-way between two walls, or deep inside an object on its symmetry plane.
    """
    size = np.linalg.norm(normal, axis=1)[:, None]
    return np.where(size > 0.0, normal / np.where(size > 0.0, size, 1.0), -np.eye(normal.shape[1])[1])


def turned_towards(mean: Float, own: Float, share: Float) -> Float:
    """Return mean normals (c, d) of an object, turned by a share (c,) towards outward normals (c, d) of the body."""
    size, own_size = (np.linalg.norm(normal, axis=1)[:, None] for normal in (mean, own))
    return np.asarray((1.0 - share[:, None]) * mean - share[:, None] * size * own / own_size)


_FACES_DOWN = -0.5
"""Component along y of a surface's normal below which the surface faces down."""


def bases_of(normal: Float, surface: Float | None = None) -> Float:
    """Return orthonormal bases (c, d, d) with unit normals (c, d), turned from that of an upright object the short way.

    The normal of an upright object is -y, and its tangents are x and z.  On a surface that faces down, by its normals
    (c, d) at rest, they are the mirror images of those on one that faces up.
    """
    d = normal.shape[1]
    n = np.zeros((len(normal), 3))
    n[:, :d] = normal
    if surface is not None and (down := surface[:, 1] < _FACES_DOWN).any():
        flip = np.where(down[:, None], np.array([1.0, -1.0, 1.0])[:d], 1.0)
        return np.asarray(bases_of(normal * flip) * flip[:, None, :])
    # Rodrigues' formula for the rotation that takes -y to n
    cosine = -n[:, 1]
    half = np.maximum(1.0 + cosine, 0.0)
    opposite = half < 1e-12
    factor = 1.0 / np.where(opposite, 1.0, half)
    along = np.stack([1.0 - factor * n[:, 0] ** 2, n[:, 0], -factor * n[:, 0] * n[:, 2]], axis=1)
    across = np.stack([-factor * n[:, 0] * n[:, 2], n[:, 2], 1.0 - factor * n[:, 2] ** 2], axis=1)
    along[opposite], across[opposite] = [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]  # about z, which a section has too
    return np.stack([n, along, across], axis=1)[:, :d, :d]


def rotated_delassus(delassus: Float, rotations: Float, points: Int | None = None) -> Float:
    """Return the Delassus operator (k, d, k, d) of some points along their own directions.

    Parameters
    ----------
    delassus : (c, d, c, d) mm/N, in the directions before
    rotations : (k, d, d) from these directions, point by point
    points : (k,) numbers of the points; all of them if None
    """
    k, d = rotations.shape[:2]
    if points is not None:
        rows, dofs = len(delassus) * d, (points[:, None] * d + np.arange(d)).ravel()
        delassus = delassus.reshape(rows, rows)[np.ix_(dofs, dofs)].reshape(k, d, k, d)
    if np.allclose(rotations, np.eye(d), rtol=0.0, atol=_ROUND_OFF):  # as on a plane
        return delassus
    half = (rotations @ delassus.reshape(k, d, k * d)).reshape(k * d, k, d)
    return np.asarray((half.transpose(1, 0, 2) @ rotations.transpose(0, 2, 1)).transpose(1, 0, 2).reshape(k, d, k, d))


def block_diagonal(blocks: Float) -> sp.csr_array:
    """Return the sparse matrix (c m, c n) of blocks (c, m, n)."""
    c = len(blocks)
    return sp.csr_array(sp.bsr_array((blocks, np.arange(c), np.arange(c + 1))))
