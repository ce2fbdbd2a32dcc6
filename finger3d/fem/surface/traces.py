"""Traces and strains of a displacement field as sparse rows, for contact points and gauges.

Contact unknowns live at surface vertices: with phi_i the linear hats, a point's displacement is
``int phi_i u / int phi_i`` and a nodal force f_i acts as the traction ``f_i phi_i / int phi_i``.

A field on another surface above the points is interpolated to them; the meshes need not match.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float, Int, freeze_arrays
from finger3d.errors import Finger3dError
from finger3d.fem.mesh.elements import Element, quadrature
from finger3d.fem.mesh.locate import cells_at, inverse_map
from finger3d.fem.mesh.simplex import CONTACT, FREE_FACES, Mesh
from finger3d.geometry.surface import Triangles

_SURFACE_DEGREE = 5  # hats times quadratic traces are cubic, curvature adds a little


@dataclass(frozen=True)
class BoundarySurface:
    """Contact points of a boundary.

    Attributes
    ----------
    nodes : (c,) vertex numbers
    face : (c,) number in `FREE_FACES` of the face that each point belongs to, -1 for any other
        A vertex on a crease is a point of each of its faces.
    points : (c, d) mm, at rest
    area : (c,) mm2
        Integral of the hat: a nodal force over it is the nodal pressure.
    normals : (c, d)
        Outward unit normals, from the weighted means over the samples.
    trace : (c, n)
        Weighted displacement of a point = trace @ u.
    samples : (q, d) mm, quadrature points on the boundary at rest
    average : (c, q)
        Weighted means at the points of values at `samples`.
    hats : (c, q)
        Hat function of every point at `samples`, with the sparsity pattern of `average`.
    interpolate : (q, n)
        Value of a nodal field at `samples`.
    along : d - 1 times (q, n)
        Its derivatives along the axes of the facets' reference simplex at `samples`.
    """

    nodes: Int
    face: NDArray[np.int8]
    points: Float
    area: Float
    normals: Float
    trace: sp.csr_matrix
    samples: Float
    average: sp.csr_matrix
    interpolate: sp.csr_matrix
    hats: sp.csr_matrix
    along: tuple[sp.csr_matrix, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def centroids(self) -> Float:
        """Centroids (c, d) mm of the hat functions, where nodal forces act."""
        return np.asarray(self.average @ self.samples)

    @cached_property
    def vector_trace(self) -> sp.csr_matrix:
        """Rows (c d, n d) of `trace` on displacements, a row for each of their components."""
        return self._on_vectors(self.trace)

    @cached_property
    def vector_interpolate(self) -> sp.csr_matrix:
        """Rows (q d, n d) of `interpolate` on displacements."""
        return self._on_vectors(self.interpolate)

    @cached_property
    def vector_slopes(self) -> sp.csr_matrix:
        """Rows (q (d - 1) d, n d) of the slopes `along`; those of a sample follow each other."""
        count, d = len(self.along), self.points.shape[1]
        rows = self._on_vectors(sp.vstack(self.along, format="csr"))
        order = np.arange(rows.shape[0]).reshape(count, -1, d).swapaxes(0, 1).ravel()
        return sp.csr_matrix(rows[order])

    @cached_property
    def to_nodes(self) -> sp.csr_matrix:
        """Transposes (n, c + d q) of `trace`, `interpolate` and `along`, side by side."""
        rows = sp.vstack([self.trace, self.interpolate, *self.along], format="csr")
        return sp.csr_matrix(rows.T)

    @cached_property
    def spread(self) -> sp.csr_matrix:
        """Transpose (q, c) of `average`."""
        return sp.csr_matrix(self.average.T)

    def _on_vectors(self, rows: sp.csr_matrix) -> sp.csr_matrix:
        return sp.csr_matrix(sp.kron(rows, np.eye(self.points.shape[1]), format="csr"))

    @cached_property
    def interpolation(self) -> sp.csr_matrix:
        """Linear interpolation (q, c) of values at the points to the samples.

        Where a neighbour is not among the points, those that are share its weight.
        """
        total = np.asarray(self.hats.sum(axis=0)).ravel()
        return sp.csr_matrix(sp.diags_array(1.0 / total) @ self.hats.T)


def surface(mesh: Mesh, label: str, thickness: float = 1.0) -> BoundarySurface:
    """Contact points of the boundary `label`; `thickness` (mm) is the width of a 2D section."""
    d = mesh.dim
    facets = mesh.facets[label]
    element = mesh.facet_element
    bary, w = quadrature(d - 1, _SURFACE_DEGREE)
    coords = mesh.points[facets]
    weights = element.surface_measure(coords, bary) * (w * thickness)
    psi, phi = element.shape(bary), bary
    corners = facets[:, :d]
    nodes, number = np.unique(corners, return_inverse=True)
    number = number.reshape(corners.shape)
    samples = np.einsum("qk,mkd->mqd", psi, coords).reshape(-1, d)
    hat = weights[:, :, None] * phi  # (m, q, corner)
    m, q = weights.shape
    area: Float = np.bincount(number.ravel(), hat.sum(axis=1).ravel(), minlength=len(nodes)).astype(np.float64)
    which = np.broadcast_to(number[:, None, :], hat.shape)
    sample_of = np.broadcast_to(np.arange(m * q).reshape(m, q, 1), hat.shape)
    places = (which.ravel(), sample_of.ravel())
    average = sp.csr_matrix(((hat / area[which]).ravel(), places), shape=(len(nodes), m * q))
    hats = sp.csr_matrix((np.broadcast_to(phi, hat.shape).ravel(), places), shape=average.shape)
    spread = np.broadcast_to(facets[:, None, :], (m, q, facets.shape[1]))
    sample = np.repeat(np.arange(m * q), facets.shape[1])

    def sampled(nodal: Float) -> sp.csr_matrix:
        data = np.broadcast_to(nodal, spread.shape).ravel()
        return sp.csr_matrix((data, (sample, spread.ravel())), shape=(m * q, len(mesh.points)))

    values = sampled(psi)
    slopes = element.gradient(bary)
    along = tuple(sampled(slopes[:, :, k]) for k in range(d - 1))
    trace = (average @ values).tocsr()
    normals = np.asarray(average @ outward_normals([slope @ mesh.points for slope in along]))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    face = np.full(len(nodes), FREE_FACES.index(label) if label in FREE_FACES else -1, dtype=np.int8)
    return BoundarySurface(nodes, face, mesh.points[nodes], area, normals, trace, samples, average, values, hats, along)


def joined(surfaces: Sequence[BoundarySurface]) -> BoundarySurface:
    """Contact points of several faces, each with the samples of its own face only."""
    if len(surfaces) == 1:
        return surfaces[0]

    def rows(parts: Sequence[sp.csr_matrix]) -> sp.csr_matrix:
        return sp.csr_matrix(sp.vstack(parts, format="csr"))

    def blocks(parts: Sequence[sp.csr_matrix]) -> sp.csr_matrix:
        return sp.csr_matrix(sp.block_diag(parts, format="csr"))

    return BoundarySurface(
        nodes=np.concatenate([s.nodes for s in surfaces]),
        face=np.concatenate([s.face for s in surfaces]),
        points=np.concatenate([s.points for s in surfaces]),
        area=np.concatenate([s.area for s in surfaces]),
        normals=np.concatenate([s.normals for s in surfaces]),
        trace=rows([s.trace for s in surfaces]),
        samples=np.concatenate([s.samples for s in surfaces]),
        average=blocks([s.average for s in surfaces]),
        interpolate=rows([s.interpolate for s in surfaces]),
        hats=blocks([s.hats for s in surfaces]),
        along=tuple(rows(slopes) for slopes in zip(*(s.along for s in surfaces), strict=True)),
    )


def outward_normals(tangents: list[Float]) -> Float:
    """Outward unit normals (q, d) from d - 1 tangents (q, d) of a boundary."""
    first, *others = tangents
    normal = np.cross(first, others[0]) if others else np.stack([first[:, 1], -first[:, 0]], axis=1)
    return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])


def restrict(surface: BoundarySurface, keep: NDArray[np.bool_] | Int) -> BoundarySurface:
    """The contact points where `keep` (c,) holds, or those of the numbers `keep` in this order, with their samples."""
    average = surface.average[keep]
    used = np.unique(average.indices)
    return replace(
        surface,
        nodes=surface.nodes[keep],
        face=surface.face[keep],
        points=surface.points[keep],
        area=surface.area[keep],
        normals=surface.normals[keep],
        trace=surface.trace[keep],
        samples=surface.samples[used],
        average=average[:, used],
        interpolate=surface.interpolate[used],
        hats=surface.hats[keep][:, used],
        along=tuple(slope[used] for slope in surface.along),
    )


def contact_face(surface: BoundarySurface) -> BoundarySurface:
    """Return the points of the contact face."""
    on_face = surface.face == CONTACT
    return surface if on_face.all() else restrict(surface, np.flatnonzero(on_face))


def local_rows(surface: BoundarySurface, frame: Float) -> sp.csr_matrix:
    """Rows (c d, n d) that read the points' displacements in the frame (d, d), order point * d + direction."""
    return sp.kron(surface.trace, frame, format="csr")


def strain_row(mesh: Mesh, point: Float, direction: Float) -> sp.csr_matrix:
    """Row (1, n d) of the normal strain at `point` (d,) along a unit `direction` (d,), mean over cells that hold it."""
    cells = _holding(mesh, point)
    row = np.zeros(mesh.points.shape)
    for cell, bary in cells:
        nodes = mesh.cells[cell]
        slope = mesh.element.physical_gradients(mesh.points[nodes][None], bary[None])[0][0, 0]
        np.add.at(row, nodes, np.outer(slope @ direction, direction) / len(cells))
    return sp.csr_matrix(row.reshape(1, -1))


def displacement_row(mesh: Mesh, point: Float, direction: Float) -> sp.csr_matrix:
    """Row (1, n d) of the displacement at `point` (d,) along `direction` (d,)."""
    return sp.csr_matrix(direction[None] @ displacement_rows(mesh, point, np.ones(mesh.dim)))


def displacement_rows(mesh: Mesh, point: Float, signs: Float) -> sp.csr_matrix:
    """Rows (d, n d) of the displacement at `point` (d,), each component multiplied by one of the signs (d,)."""
    cells = _holding(mesh, point)
    row = np.zeros(len(mesh.points))
    for cell, bary in cells:
        np.add.at(row, mesh.cells[cell], mesh.element.shape(bary[None])[0] / len(cells))
    nodes, d = np.flatnonzero(row), len(signs)
    columns = d * nodes + np.arange(d)[:, None]
    entries, starts = np.outer(signs, row[nodes]), len(nodes) * np.arange(d + 1)
    return sp.csr_matrix((entries.ravel(), columns.ravel(), starts), shape=(d, d * len(row)))


def _holding(mesh: Mesh, point: Float) -> list[tuple[int, Float]]:
    cells = cells_at(mesh, point)
    if not cells:
        raise Finger3dError(f"gauge: the point {tuple(round(float(x), 6) for x in point)} mm lies outside the body")
    return cells


_LARGEST_BULGE = 0.25  # a curved facet's border bulges at most this far, in barycentric coordinates
_LEAST_HAT_COVERAGE = 0.5  # least share of a point's hat that must be under the other surface


def facing_trace(surface: BoundarySurface, mesh: Mesh, label: str) -> sp.csr_matrix:
    """Return the weighted mean (c, n), at the points of a surface, of a field on the facets `label` of a mesh above.

    The weights are those of the trace of the surface, so that the forces on its points are preserved: every row sums to
    1, or to 0 where less than half of the hat function of the point has facets above it.
    """
    values, there = values_over(mesh, mesh.facets[label], surface.samples)
    coverage = np.asarray(surface.average @ there.astype(float))
    scale = np.where(coverage >= _LEAST_HAT_COVERAGE, 1.0 / np.maximum(coverage, _LEAST_HAT_COVERAGE), 0.0)
    return sp.csr_matrix(sp.diags_array(scale) @ surface.average @ values)


def values_over(mesh: Mesh, facets: Int, places: Float, lowest: bool = True) -> tuple[sp.csr_matrix, NDArray[np.bool_]]:
    """Return rows (q, n) that interpolate a field on facets above points (q, d), and where there are any.

    Of several facets above a point it is the lowest that faces down, or the highest that faces up.
    """
    d = mesh.dim
    across = [0] if d == 2 else [0, 2]
    if d == 2:
        face, bary = _edges_over(mesh.points[facets], places[:, 0])
    else:
        face, bary = Triangles(mesh.points, facets[:, :3]).hits(places[:, 0], places[:, 2], lowest=lowest)
    there = face >= 0
    nodes = mesh.points[facets[face[there]]][:, :, across]
    element = mesh.facet_element
    values = element.shape(_curved(element, nodes, bary[there], places[there][:, across]))
    row = np.repeat(np.flatnonzero(there), values.shape[1])
    column = facets[face[there]].ravel()
    return sp.csr_matrix((values.ravel(), (row, column)), shape=(len(places), len(mesh.points))), there


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
