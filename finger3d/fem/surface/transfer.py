"""Interpolation of a displacement field from one surface to points of another below it; meshes need not match."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.fem.mesh.elements import Element
from finger3d.fem.mesh.locate import inverse_map
from finger3d.fem.mesh.simplex import Mesh
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.geometry.surface import Triangles

_LARGEST_BULGE = 0.25  # a curved facet's border bulges at most this far, in barycentric coordinates
_LEAST_HAT_COVERAGE = 0.5  # least share of a point's hat that must be under the other surface


def facing_trace(surface: BoundarySurface, mesh: Mesh, label: str) -> sp.csr_matrix:
    """Return the weighted mean (c, n), at the points of a surface, of a field on the facets `label` of a mesh above.

    The weights are those of the trace of the surface, so that the forces on its points are preserved: every row sums to
    1, or to 0 where less than half of the hat function of the point has facets above it.
    """
    values, there = values_over(mesh, label, surface.samples)
    coverage = np.asarray(surface.average @ there.astype(float))
    scale = np.where(coverage >= _LEAST_HAT_COVERAGE, 1.0 / np.maximum(coverage, _LEAST_HAT_COVERAGE), 0.0)
    return sp.csr_matrix(sp.diags_array(scale) @ surface.average @ values)


def values_over(mesh: Mesh, label: str, places: Float, lowest: bool = True) -> tuple[sp.csr_matrix, NDArray[np.bool_]]:
    """Return rows (q, n) that interpolate a field on facets above points (q, d), and where there are any.

    Of several facets above a point it is the lowest that faces down, or the highest that faces up.
    """
    facets = mesh.facets[label]
    d = mesh.dim
    across = [0] if d == 2 else [0, 2]
    face, bary = (
        _edges_over(mesh.points[facets], places[:, 0]) if d == 2 else _triangles_over(mesh, facets, places, lowest)
    )
    there = face >= 0
    nodes = mesh.points[facets[face[there]]][:, :, across]
    element = mesh.facet_element
    values = element.shape(_curved(element, nodes, bary[there], places[there][:, across]))
    row = np.repeat(np.flatnonzero(there), values.shape[1])
    column = facets[face[there]].ravel()
    return sp.csr_matrix((values.ravel(), (row, column)), shape=(len(places), len(mesh.points))), there


def _triangles_over(mesh: Mesh, facets: Int, places: Float, lowest: bool) -> tuple[Int, Float]:
    return Triangles(mesh.points, facets[:, :3]).hits(places[:, 0], places[:, 2], lowest=lowest)


def _edges_over(coords: Float, x: Float) -> tuple[Int, Float]:
    """Return the edge (q,) above every x, or -1, and the barycentric coordinates (q, 2) on its chord."""
    start, stop = coords[:, 0, 0], coords[:, 1, 0]
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    slack = 1e-12 * float(np.ptp(coords[:, :, 0]))
    order = np.argsort(low)
    position = np.clip(np.searchsorted(low[order], x, side="right") - 1, 0, len(low) - 1)
    face = order[position]
    t = np.clip((x - start[face]) / (stop - start)[face], 0.0, 1.0)
    face = np.where((x < low[face] - slack) | (x > high[face] + slack), -1, face)
    return face, np.stack([1.0 - t, t], axis=1)


def _curved(element: Element, nodes: Float, straight: Float, points: Float) -> Float:
    """Barycentric coordinates on curved facets (q, k, d - 1), seen from below, from those on the straight ones.

    A point whose coordinates lie far outside its facet keeps those on the straight facet.
    """
    if not element.is_quadratic:
        return straight
    bary = inverse_map(element, nodes, points, straight)
    lost = ~np.isfinite(bary).all(axis=1) | (bary.min(axis=1) < -_LARGEST_BULGE)
    return np.where(lost[:, None], straight, bary)
