"""Boundary surfaces: traces and strains as sparse rows, and the contact of a deformed surface.

Contact unknowns live at surface vertices: with phi_i the linear hats, a point's displacement is
``int phi_i u / int phi_i`` and a nodal force f_i acts as the traction ``f_i phi_i / int phi_i``.

A field on another surface above the points is interpolated to them; the meshes need not match.

With the mean gradient N of the distance over a point's hat, the gap of the point is the mean distance over the length
of N, and its normal is ``N / |N|``: a force on the point is then the resultant of the pressures on its hat, also where
the normals of the object differ there.  Derivatives of the gap leave out those of that length, whose effect is
proportional to the gap.
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
from finger3d.fem.mesh import CONTACT, FREE_FACES, Element, Mesh, cells_at, in_symmetry_planes, inverse_map, quadrature
from finger3d.fem.tensors import LEAST_SLOPE, bases_of, block_diagonal, turned_towards, unit_normals
from finger3d.geometry.surface import Triangles

_SURFACE_DEGREE = 5  # hats times quadratic traces are cubic, curvature adds a little

OF_POINTS = "nodes", "face", "points", "area", "normals"
"""Arrays of a `BoundarySurface` with an entry for each point."""


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

    arrays = {name: np.concatenate([getattr(s, name) for s in surfaces]) for name in (*OF_POINTS, "samples")}
    return BoundarySurface(
        **arrays,
        trace=rows([s.trace for s in surfaces]),
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
        **{name: getattr(surface, name)[keep] for name in (*OF_POINTS, "trace")},
        samples=surface.samples[used],
        average=average[:, used],
        interpolate=surface.interpolate[used],
        hats=surface.hats[keep][:, used],
        along=tuple(slope[used] for slope in surface.along),
    )


def points_at(surface: BoundarySurface, nodes: Int, face: NDArray[np.int8]) -> BoundarySurface:
    """Return the contact points of a surface at some nodes (k,) of some faces (k,), in this order."""
    place = {key: k for k, key in enumerate(zip(surface.nodes.tolist(), surface.face.tolist(), strict=True))}
    return restrict(surface, np.array([place[key] for key in zip(nodes.tolist(), face.tolist(), strict=True)]))


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


@dataclass(frozen=True)
class _Area:
    """Deformed over initial area of a face at its samples, and its derivatives.

    Attributes
    ----------
    ratio, initial : (q,) the ratio, and the initial length or area of the facets' reference simplex
    moved, turned : d - 1 arrays (q, d), tangents of the deformed face, and the derivative of its area by each
    """

    face: BoundarySurface
    ratio: Float
    initial: Float
    moved: list[Float]
    turned: list[Float]

    @classmethod
    def of(cls, face: BoundarySurface, points: Float, u: Float) -> _Area:
        """Return the areas at displacements u (n, d) of the nodes."""
        rest, moved = ([slope @ x for slope in face.along] for x in (points, points + u))
        if u.shape[1] == 2:
            vector = moved[0]
            initial = np.linalg.norm(rest[0], axis=1)
        else:
            vector = np.cross(moved[0], moved[1])
            initial = np.linalg.norm(np.cross(rest[0], rest[1]), axis=1)
        length = np.linalg.norm(vector, axis=1)
        unit = vector / length[:, None]
        turned = [unit] if u.shape[1] == 2 else [np.cross(moved[1], unit), np.cross(unit, moved[0])]
        return cls(face, length / initial, initial, moved, turned)

    def along(self, weights: Float) -> list[Float]:
        """Return the sums of the derivatives with weights (q,), along the d - 1 axes of the facets (q, d)."""
        scaled = (weights / self.initial)[:, None]
        return [scaled * one for one in self.turned]

    @cached_property
    def turns(self) -> sp.csr_array:
        """Derivative (q, q d (d - 1)) of the ratio by the tangents."""
        turned = np.concatenate(self.turned, axis=1) / self.initial[:, None]
        return block_diagonal(turned[:, None, :])

    @cached_property
    def derivative(self) -> sp.csr_matrix:
        """Derivative (q, n d) of the ratio."""
        return sp.csr_matrix(self.turns @ self.face.vector_slopes)

    @cached_property
    def normal_slopes(self) -> Float:
        """Derivative (q, d, (d - 1) d) of the area times its normal by the tangents."""
        d = self.moved[0].shape[1]
        if d == 2:
            return np.broadcast_to(np.array([[0.0, 1.0], [-1.0, 0.0]]), (len(self.ratio), d, d))
        one, other = self.moved
        turns = np.cross(np.eye(d), other[:, None, :]), np.cross(one[:, None, :], np.eye(d))
        return np.asarray(np.swapaxes(np.concatenate(turns, axis=1), 1, 2))

    def second_derivative(self, weights: Float) -> sp.csr_matrix:
        """Return the sum (n d, n d) of the second derivatives with weights (q,).

        The area is the length of its normal v.  With ``C = dv/dt`` by the tangents t, and ``e = v / |v|``, its second
        derivative by the tangents is ``C^T (I - e e^T) C / |v| + e v''``.
        """
        unit, slopes, d = outward_normals(self.moved), self.normal_slopes, self.moved[0].shape[1]
        second = np.swapaxes(slopes, 1, 2) @ _across(unit) @ slopes / (self.ratio * self.initial)[:, None, None]
        if d == 3:
            twist = np.cross(np.eye(d), unit[:, None, :])  # e . (a x b) = b^T twist a
            second[:, d:, :d] += twist
            second[:, :d, d:] += np.swapaxes(twist, 1, 2)
        second *= (weights / self.initial)[:, None, None]
        tangents = self.face.vector_slopes
        return sp.csr_matrix(tangents.T @ block_diagonal(second) @ tangents)


@dataclass(frozen=True)
class DeformedContact:
    """Contact of a deformed face.

    Attributes
    ----------
    gap : (c,) mm
    slope : (c,) length of the mean of the object's unit normals
    bases : (c, d, d) directions of the points
    samples_gap, samples_normal : (q,) mm, (q, d) gap and unit normal at the samples
    follows_area : whether forces are pressures on the deformed area, which a rigid object exerts; beside an elastic one
        they act along the common normal of both bodies
    turns : (c, d, d) derivative of the normal by the mean of the body's own normal over the deformed area
    """

    face: BoundarySurface
    gap: Float
    slope: Float
    bases: Float
    samples_gap: Float
    samples_normal: Float
    area: _Area
    follows_area: bool
    turns: Float

    @cached_property
    def _mean_area(self) -> Float:
        return np.asarray(self.face.average @ self.area.ratio)

    @cached_property
    def _slope_area(self) -> Float:
        """Sums (c,) over a hat are divided by these for a gap."""
        return self.slope * self._mean_area

    def nodal_forces(self, force: Float) -> Float:
        """Return the nodal forces (n, d) of forces (c, d) at the points, along their directions."""
        face, area = self.face, self.area
        tangential = force.copy()
        tangential[:, 0] = force[:, 0] * (not self.follows_area)
        at_points = np.einsum("ctk,ct->ck", self.bases, tangential)
        if not self.follows_area:
            return np.asarray(face.trace.T @ at_points)
        pressure, uneven = self._spread(force[:, 0] / self._slope_area)
        at_samples = (pressure * area.ratio)[:, None] * self.samples_normal
        return np.asarray(face.to_nodes @ np.concatenate([at_points, at_samples, *area.along(uneven)]))

    def _spread(self, per_area: Float) -> tuple[Float, Float]:
        """Return pressures (q,) and weights (q,) of the area's derivatives under forces per area (c,) at the points."""
        pressure, mean = (self.face.spread @ np.stack([per_area, per_area * self.slope * self.gap], axis=1)).T
        return pressure, self.samples_gap * pressure - mean

    @cached_property
    def rows(self) -> sp.csr_matrix:
        """Rows (c d, n d) along which the forces act: `nodal_forces` are those of the transpose."""
        face, (c, d) = self.face, self.bases.shape[:2]
        bases = self.bases.copy()
        if self.follows_area:
            bases[:, 0] = 0.0
        rows = block_diagonal(bases) @ face.vector_trace
        if self.follows_area:
            rows = rows + sp.csr_array((np.ones(c), (d * np.arange(c), np.arange(c))), (c * d, c)) @ self._d_point_gap
        return sp.csr_matrix(rows)

    def displacement(self, motion: Float) -> Float:
        """Return the displacement (c d, k) of the points along the rows in motions (n d, k), unassembled."""
        face, (of_gap, of_area) = self.face, self._weights
        moved = np.einsum("cij,cjk->cik", self.bases, (face.vector_trace @ motion).reshape(*self.bases.shape[:2], -1))
        if self.follows_area:
            widened = self._normals @ (face.vector_interpolate @ motion)
            moved[:, 0] = of_gap @ widened + of_area @ (self.area.turns @ (face.vector_slopes @ motion))
        return np.asarray(moved.reshape(-1, motion.shape[1]))

    @cached_property
    def _d_point_gap(self) -> sp.csr_matrix:
        """Derivative (c, n d) of the gap of the points."""
        of_gap, of_area = self._weights
        return sp.csr_matrix(of_gap @ self._d_gap + of_area @ self.area.derivative)

    @cached_property
    def _weights(self) -> tuple[sp.csr_array, sp.csr_array]:
        """Derivatives (c, q) of the gap of the points by the gap at the samples, and by the area's ratio there."""
        weight = sp.diags_array(1.0 / self._slope_area) @ self.face.average
        deviation = weight @ sp.diags_array(self.samples_gap) - sp.diags_array(self.slope * self.gap) @ weight
        return weight @ sp.diags_array(self.area.ratio), deviation

    @cached_property
    def _normals(self) -> sp.csr_array:
        """Normals at the samples, as a matrix (q, q d)."""
        return block_diagonal(self.samples_normal[:, None, :])

    def gap_rows(self, moved: Float) -> sp.csr_matrix:
        """Return the derivative (c, n d) of the gap beside an elastic object.

        Its material at the points has moved by (c, d), mm, which widens the gap along the common normal.  This turns
        with the body; the normal of the object is taken as constant.
        """
        face, d = self.face, self.bases.shape[2]
        mean = sp.kron(sp.diags_array(1.0 / self._mean_area) @ face.average, sp.eye_array(d))
        turned = block_diagonal(self.area.normal_slopes / self.area.initial[:, None, None]) @ face.vector_slopes
        widened = np.einsum("ck,ckl->cl", moved, self.turns)
        return sp.csr_matrix(self._d_point_gap + block_diagonal(widened[:, None, :]) @ (mean @ turned))

    @cached_property
    def _d_gap(self) -> sp.csr_matrix:
        """Derivative (q, n d) of the gap at the samples."""
        return sp.csr_matrix(self._normals @ self.face.vector_interpolate)

    def geometric_stiffness(self, force: Float, curvature: Float | None = None) -> sp.csr_matrix:
        """Return the geometric stiffness (n d, n d) of normal forces (c,) N, which is subtracted from K.

        It is the second derivative of the gaps, weighted with the forces.  The pressure acts on the deformed area;
        otherwise it would push mid-edge nodes along the surface, and K would be indefinite at a few G.

        Parameters
        ----------
        curvature : (q, d, d) array, 1/mm, optional
            Second derivatives of the gap at the samples; zero unless given.
        """
        face = self.face
        spread = self.area.derivative
        at_samples, uneven = self._spread(force / self._slope_area)
        pressure = sp.diags_array(at_samples)
        normal = self.rows[:: self.bases.shape[1]]
        per_mean = sp.diags_array(force / self._mean_area)
        half = self._d_gap.T @ pressure @ spread - normal.T @ per_mean @ face.average @ spread
        total = half + half.T + self.area.second_derivative(uneven)
        if curvature is not None:
            weighted = (at_samples * self.area.ratio)[:, None, None] * curvature
            total = total + face.vector_interpolate.T @ block_diagonal(weighted) @ face.vector_interpolate
        return sp.csr_matrix(total)


def deformed_contact(
    face: BoundarySurface,
    points: Float,
    displacement: Float,
    distance: tuple[Float, Float],
    axes: tuple[str, ...],
    object_share: Float | None = None,
) -> DeformedContact:
    """Contact of a deformed face.

    Parameters
    ----------
    points, displacement : (n, d) arrays, mm
        Nodes of the mesh at rest, and their displacement.
    distance : (q,) array, mm, and (q, d) array
        Gap at the samples, and the unit normals into the body there, along which it is measured.
    axes : tuple of str
        Normals of the symmetry planes, in which the normals of points on them lie.
    object_share : (c,) array, optional
        Share of an elastic object in the compliance of each point; the common normal turns from that of the object
        towards that of the body by this share.
    """
    area, (gap, normal) = _Area.of(face, points, displacement), distance
    total = (face.average @ area.ratio)[:, None]

    def mean_of(normals: Float) -> Float:
        return in_symmetry_planes((face.average @ (normals * area.ratio[:, None])) / total, face.points, axes)

    mean = mean_of(normal)
    slope = np.linalg.norm(mean, axis=1)
    turns = np.zeros((*mean.shape, mean.shape[1]))
    if object_share is not None:
        own = mean_of(outward_normals(area.moved))
        size = np.linalg.norm(own, axis=1)
        turns = -(object_share * slope / size)[:, None, None] * _across(own / size[:, None])
        mean = turned_towards(mean, own, object_share)
    bases = bases_of(unit_normals(mean), face.normals)
    if object_share is not None:
        turns = _across(bases[:, 0]) @ turns / np.linalg.norm(mean, axis=1)[:, None, None]
    slope = np.maximum(slope, LEAST_SLOPE)
    point_gap = (face.average @ (gap * area.ratio)) / total[:, 0] / slope
    return DeformedContact(face, point_gap, slope, bases, gap, normal, area, object_share is None, turns)


def _across(unit: Float) -> Float:
    """Return the projections (c, d, d) onto the planes across unit vectors (c, d)."""
    return np.asarray(np.eye(unit.shape[1]) - unit[:, :, None] * unit[:, None, :])
