"""Directions of contact points: normals and tangents."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float


def bases_of(normal: Float) -> Float:
    """Return orthonormal bases (c, d, d) with unit normals (c, d), turned from that of an upright object the short way.

    The normal of an upright object is -y, and its tangents are x and z.
    """
    d = normal.shape[1]
    n = np.zeros((len(normal), 3))
    n[:, :d] = normal
    # Rodrigues' formula for the rotation that takes -y to n
    cosine = -n[:, 1]
    half = np.maximum(1.0 + cosine, 0.0)
    opposite = half < 1e-12
    factor = 1.0 / np.where(opposite, 1.0, half)
    along = np.stack([1.0 - factor * n[:, 0] ** 2, n[:, 0], -factor * n[:, 0] * n[:, 2]], axis=1)
    across = np.stack([-factor * n[:, 0] * n[:, 2], n[:, 2], 1.0 - factor * n[:, 2] ** 2], axis=1)
    along[opposite], across[opposite] = [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]  # about z, which a section has too
    return np.stack([n, along, across], axis=1)[:, :d, :d]
