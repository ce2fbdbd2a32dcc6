"""Quality of simplex meshes: angles, curved volume, curved Jacobians."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from finger3d._types import Float, Int
from finger3d.fem.mesh.elements import EDGES, quadrature
from finger3d.fem.mesh.simplex import FACETS, Mesh

_JACOBIAN_DEGREE = {2: 2, 3: 3}
"""Degree of the Jacobian determinant of a quadratic element, by dimension."""


def _determinants(mesh: Mesh, bary: Float) -> Float:
    """Jacobian determinants (q, e) of the cells at barycentric points (q, d + 1)."""
    nodes = mesh.points[mesh.cells]
    out = np.empty((len(bary), len(nodes)))
    for q in range(len(bary)):  # one point at a time bounds the memory
        out[q] = np.linalg.det(mesh.element.jacobians(nodes, bary[q : q + 1])[:, 0])
    return out


def curved_volume(mesh: Mesh) -> float:
    """Volume (area in 2D) of a quadratic mesh, mm^d."""
    bary, weights = quadrature(mesh.dim, _JACOBIAN_DEGREE[mesh.dim])
    return float((weights @ _determinants(mesh, bary)).sum())


def curved_jacobians(mesh: Mesh) -> Float:
    """Smallest Jacobian determinant (e,) over the nodes and the centre of each quadratic cell, mm^d."""
    d = mesh.dim
    return np.asarray(
        _determinants(mesh, np.vstack([mesh.element.nodes, np.full((1, d + 1), 1.0 / (d + 1))])).min(axis=0)
    )


def most_distorted(mesh: Mesh, u: Float) -> tuple[int, float]:
    """Return the cell that displacements u (n, d) mm compress most, and its ratio of volumes after and before.

    Volumes are the smallest Jacobian determinants over the nodes and the centre of a cell.
    """
    ratio = curved_jacobians(replace(mesh, points=mesh.points + u)) / curved_jacobians(mesh)
    worst = int(ratio.argmin())
    return worst, float(ratio[worst])


def cell_angles_deg(points: Float, cells: Int) -> Float:
    """Smallest angle (2D) or dihedral angle (3D) (e,) of straight cells, degrees; 0 for a flat or inverted one."""
    d = points.shape[1]
    p = points[cells[:, : d + 1]]
    if d == 2:
        edge = p[:, [1, 2, 0]] - p
        back = -edge[:, [2, 0, 1]]
        sine = edge[..., 0] * back[..., 1] - edge[..., 1] * back[..., 0]
        angle = np.degrees(np.arctan2(sine, np.einsum("eix,eix->ei", edge, back)))
        return np.asarray(np.maximum(angle.min(axis=1), 0.0))
    faces = p[:, FACETS[3]]
    normal = np.cross(faces[:, :, 1] - faces[:, :, 0], faces[:, :, 2] - faces[:, :, 0])
    length = np.linalg.norm(normal, axis=2, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    i, j = EDGES[3].T  # faces i and j meet in the edge opposite to i, j: every pair once
    cosine = -np.einsum("eix,eix->ei", normal[:, i], normal[:, j])
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).min(axis=1)
    volume = np.einsum("ex,ex->e", p[:, 1] - p[:, 0], np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 0]))
    return np.where(volume > 0, angle, 0.0)


def min_angle_deg(mesh: Mesh) -> float:
    """Smallest (dihedral) angle of a mesh, degrees."""
    return float(cell_angles_deg(mesh.points, mesh.cells).min())
