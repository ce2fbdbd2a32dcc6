"""Location of points in a mesh: the inverse isoparametric map, and the cells that contain given points."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float, Int
from finger3d.fem.mesh.elements import Element
from finger3d.fem.mesh.simplex import Mesh

_NEWTON_ITERATIONS = 8
"""Newton iterations on a quadratic element; the map of a linear one is inverted exactly by the first."""

_SETTLED = 1e-9
"""Largest step, in barycentric coordinates, of the last iteration: the next would be of the order of its square."""

_INSIDE = -1e-6
"""Least barycentric coordinate of a point that counts as inside a cell."""

_NEAREST_CELLS = {2: 12, 3: 40}
"""Cells with the nearest centroids, by dimension, among which the one that holds a point is searched."""


def inverse_map(element: Element, nodes: Float, points: Float, start: Float | None = None) -> Float:
    """Return the barycentric coordinates (m, d + 1) of points (m, d) in cells with node coordinates (m, k, d).

    Newton's method from `start` (m, d + 1), the centroid by default, with steps of at most 1 in every reference
    coordinate. A point far outside its cell may not converge; its coordinates then are negative or do not map to it.
    """
    d = element.dim
    bary = np.full((len(points), d + 1), 1.0 / (d + 1)) if start is None else start.copy()
    for _ in range(_NEWTON_ITERATIONS if element.is_quadratic else 1):
        miss = points - np.einsum("mk,mkd->md", element.shape(bary), nodes)
        jacobian = np.einsum("mkD,mkd->mDd", nodes, element.gradient(bary))
        regular = np.abs(np.linalg.det(jacobian)) > 1e-12 * np.abs(jacobian).max(axis=(1, 2), initial=0.0) ** d
        step = np.zeros_like(miss)
        step[regular] = np.linalg.solve(jacobian[regular], miss[regular][:, :, None])[:, :, 0]
        step = np.clip(step, -1.0, 1.0)
        bary = bary + np.hstack([-step.sum(axis=1, keepdims=True), step])
        if np.abs(step).max(initial=0.0) < _SETTLED:
            break
    return bary


def cells_at(mesh: Mesh, point: Float) -> list[tuple[int, Float]]:
    """Return the cells that hold a point (d,) and its barycentric coordinates there.

    Several cells hold a point of a shared facet, none a point outside the mesh.
    """
    low, high = mesh.boxes
    near = np.flatnonzero(np.all((low <= point) & (point <= high), axis=1))
    bary = inverse_map(mesh.element, mesh.points[mesh.cells[near]], np.broadcast_to(point, (len(near), mesh.dim)))
    inside = bary.min(axis=1) >= _INSIDE
    return [(int(cell), b) for cell, b in zip(near[inside], bary[inside], strict=True)]


def locate(mesh: Mesh, points: Float) -> tuple[Int, Float]:
    """Return one cell (p,) that holds each of the points (p, d), -1 outside, and barycentric coordinates (p, d + 1)."""
    from scipy.spatial import cKDTree

    d = mesh.dim
    corners = mesh.points[mesh.cells]
    count = min(_NEAREST_CELLS[d], len(mesh.cells))
    _, near = cKDTree(corners[:, : d + 1].mean(axis=1)).query(points, k=count)
    near = near.reshape(len(points), count)
    best = np.full(len(points), -np.inf)
    where = np.full((len(points), d + 1), 1.0 / (d + 1))
    cell = np.full(len(points), -1)
    for k in range(count):
        left = np.flatnonzero(best < _INSIDE)
        if not len(left):
            break
        bary = inverse_map(mesh.element, corners[near[left, k]], points[left])
        least = bary.min(axis=1)
        better = least > best[left]
        where[left[better]], cell[left[better]] = bary[better], near[left[better], k]
        best[left[better]] = least[better]
    cell[best < _INSIDE] = -1
    return cell, where
