"""Fields recovered from unknowns: displacement, strain and stress at nodes, strain at points, and mean tractions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from finger3d._types import Float, Int
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import Mesh, MeshPart, locate, part_of_facets, quadrature, signed_volumes, signs_into_part

Across = Callable[[Float, Float], tuple[Float, Float]]

_CELLS_AT_ONCE = 4096  # bounds the memory of their gradients


def displacement(mesh: Mesh, unknowns: Float) -> Float:
    """Displacements (n, d) mm from all unknowns (N,)."""
    return unknowns[: mesh.points.size].reshape(mesh.points.shape)


def averaged(mesh: Mesh, of_part: Callable[[MeshPart], tuple[Float, ...]]) -> tuple[Float, ...]:
    """Nodal fields (n, ...) of a body of several parts, at interfaces the mean of the parts weighted by volume.

    Parameters
    ----------
    of_part : returns the fields (n', ...) at the nodes of one part
    """
    parts = mesh.by_part
    if len(parts) == 1:
        return of_part(parts[0])
    weight = np.zeros((len(parts), len(mesh.points)))
    for row, part in zip(weight, parts, strict=True):
        volume = np.abs(signed_volumes(part.mesh))
        np.add.at(row, part.nodes[part.mesh.cells], volume[:, None])
    weight /= weight.sum(axis=0)
    total: list[Float] = []
    for row, part in zip(weight, parts, strict=True):
        fields = of_part(part)
        total = total or [np.zeros((len(mesh.points), *field.shape[1:])) for field in fields]
        for sum_, field in zip(total, fields, strict=True):
            sum_[part.nodes] += row[part.nodes].reshape(-1, *[1] * (field.ndim - 1)) * field
    return tuple(total)


def strain_and_stress(
    mesh: Mesh,
    unknowns: Float,
    laws: Sequence[Elasticity],
    pressure_scale: float,
    across: Sequence[Across] | None = None,
) -> tuple[Float, Float]:
    """Linear strain and stress (MPa) at the nodes.

    Parameters
    ----------
    unknowns : (N,) displacements, then pressures in units of `pressure_scale` (MPa) in the mixed form
    laws : of the parts by their number
    across : of a section, returns strain and stress (n,) across it from those in its plane, for every part

    Returns
    -------
    strain, stress : (n, d, d), or (n, 3, 3) with `across`
    """
    u = displacement(mesh, unknowns)
    vertex_pressure = pressure_scale * unknowns[mesh.points.size :]

    def of_part(part: MeshPart) -> tuple[Float, Float]:
        law = laws[part.number]
        strain = nodal_strain(part.mesh, u[part.nodes])
        sigma = law.stress(strain)
        if law.mixed:
            p = nodal_pressure(part.mesh, vertex_pressure[part.corners])
            sigma = sigma + p[:, None, None] * np.eye(mesh.dim)
        if across is None:
            return strain, sigma
        return whole(strain, sigma, *across[part.number](strain, sigma))

    strain, sigma = averaged(mesh, of_part)
    return strain, sigma


def nodal_pressure(mesh: Mesh, at_vertices: Float) -> Float:
    """Values (n,) at all nodes of a field that is linear over each cell, from those at the vertices, ascending."""
    p = np.zeros(len(mesh.points))
    p[mesh.vertices] = at_vertices
    p[mesh.cells[:, mesh.dim + 1 :]] = p[mesh.cells[:, mesh.element.edges]].mean(axis=2)
    return p


def nodal_gradient(mesh: Mesh, u: Float) -> Float:
    """Displacement gradient (n, d, d) at the nodes, row the component: volume-weighted mean over the adjacent cells."""
    n, d = mesh.points.shape
    k = mesh.cells.shape[1]
    total, weight = np.zeros((n, d, d)), np.zeros(n)
    for start in range(0, len(mesh.cells), _CELLS_AT_ONCE):
        cells = mesh.cells[start : start + _CELLS_AT_ONCE]
        gradients, det = mesh.element.physical_gradients(mesh.points[cells], mesh.element.nodes)
        slope = np.einsum("eki,eqkj->eqij", u[cells], gradients, optimize=True)
        volume = np.broadcast_to(det.mean(axis=1)[:, None], (len(cells), k))
        np.add.at(total, cells, slope * volume[:, :, None, None])
        np.add.at(weight, cells, volume)
    return total / weight[:, None, None]


def extrapolated(mesh: Mesh, values: Float) -> Float:
    """Values (n, ...) at the nodes of a field known at the quadrature points (e q, ...), q = d + 1 in a cell.

    It is extrapolated linearly within each cell, and averaged over the cells at a node by volume.
    """
    n, d = mesh.points.shape
    bary, _ = quadrature(d, 2)
    to_nodes = mesh.element.nodes @ np.linalg.inv(bary)
    local = np.einsum("kq,eq...->ek...", to_nodes, values.reshape(len(mesh.cells), d + 1, *values.shape[1:]))
    weights = np.broadcast_to(np.abs(signed_volumes(mesh))[:, None], mesh.cells.shape)
    total, weight = np.zeros((n, *values.shape[1:])), np.zeros(n)
    np.add.at(total, mesh.cells, local * weights.reshape(*weights.shape, *[1] * (values.ndim - 1)))
    np.add.at(weight, mesh.cells, weights)
    return total / weight.reshape(-1, *[1] * (values.ndim - 1))


def nodal_strain(mesh: Mesh, u: Float) -> Float:
    """Linear strain (n, d, d) at the nodes."""
    slope = nodal_gradient(mesh, u)
    return 0.5 * (slope + np.swapaxes(slope, 1, 2))


def whole(strain: Float, sigma: Float, strain_across: Float, stress_across: Float) -> tuple[Float, Float]:
    """Strain and stress (n, 3, 3) of a section from those in its plane (n, 2, 2) and across it (n,)."""
    e, s = np.zeros((len(strain), 3, 3)), np.zeros((len(strain), 3, 3))
    e[:, :2, :2], s[:, :2, :2] = strain, sigma
    e[:, 2, 2], s[:, 2, 2] = strain_across, stress_across
    return e, s


@dataclass(frozen=True)
class StrainReader:
    """Reads the strain of a displacement field at points of a mesh, those in mirror images included.

    Attributes
    ----------
    inside : (p,) whether a point lies in the body
    cells : (m,) the cells that hold the points inside
    gradients : (m, k, d) of the shape functions there, 1/mm
    turn : (m, d) signs of the mirror image
    """

    mesh: Mesh
    inside: NDArray[np.bool_]
    cells: Int
    gradients: Float
    turn: Float

    @classmethod
    def at(cls, mesh: Mesh, points: Float, axes: tuple[str, ...]) -> StrainReader:
        """Find the cells of points (p, d)."""
        d = mesh.dim
        turn = signs_into_part(points, axes)
        cells, bary = locate(mesh, points * turn)
        inside = cells >= 0
        nodes = mesh.points[mesh.cells[cells[inside]]]
        reference = mesh.element.gradient(bary[inside])
        jacobian = np.einsum("ekD,ekd->eDd", nodes, reference)
        return cls(mesh, inside, cells[inside], reference @ np.linalg.inv(jacobian), turn[inside][:, :d])

    def strain(self, u: Float) -> Float:
        """Return the in-plane strain (p, 3), components xx, yy, xy, of displacements (n, d); NaN outside the body."""
        return self._in_plane(self._gradient(u))

    def green_lagrange(self, u: Float) -> Float:
        """Return the in-plane Green-Lagrange strain (p, 3), components xx, yy, xy; NaN outside the body."""
        gradient = self._gradient(u)
        return self._in_plane(gradient + 0.5 * gradient.transpose(0, 2, 1) @ gradient)

    def _gradient(self, u: Float) -> Float:
        """Return the displacement gradient (m, d, d), du_i / dX_j, at the points inside."""
        gradient = np.einsum("eki,ekj->eij", u[self.mesh.cells[self.cells]], self.gradients)
        return np.asarray(gradient * self.turn[:, :, None] * self.turn[:, None, :])

    def _in_plane(self, tensor: Float) -> Float:
        """Return the components xx, yy and the mean of xy and yx of tensors (m, d, d) at all points (p, 3)."""
        out = np.full((len(self.inside), 3), np.nan)
        out[self.inside] = np.stack(
            [tensor[:, 0, 0], tensor[:, 1, 1], 0.5 * (tensor[:, 0, 1] + tensor[:, 1, 0])], axis=1
        )
        return out


_TRACTION_DEGREE = 5  # products of quadratic functions, and a little curvature
_LEAST_BOX_COVERAGE = 0.99  # least share of the boxes on the face: facets at a curved border are cut along their chords


def mean_traction_weights(
    mesh: Mesh, label: str, boxes: Float, thickness: float = 1.0, moduli: Sequence[float] = ()
) -> Float:
    """Return weights (n,), 1/mm2, of the nodal forces along one axis, whose sum is the mean traction in boxes.

    The traction is the field of the face's shape functions that does the same work as the nodal forces (consistent
    boundary flux, Carey 1982): it converges faster than the stress of the cells at the face.  The weights of boxes that
    tile the face, times their areas, are 1 in sum at every node, so that the mean tractions add up to the force.

    Parameters
    ----------
    label : a level face
    boxes : (b, 2, d - 1) array, mm
        Lower and upper bounds of x, and of z in 3D; the mean is that over all boxes together.
    thickness : width of a section, mm
    moduli : stiffness of each part by its number; all equal unless given

    Raises
    ------
    Finger3dError
        If the boxes are not on the face.

    Notes
    -----
    The traction jumps where parts of different stiffness meet.  There it is discontinuous: it has its full order on the
    stiffer part, which carries the singular part, and is linear along the edges of the softer part that end there.
    These are as many unknowns as there are forces in 2D and fewer in 3D, where the fit minimises the norm of what is
    left.
    """
    facets = mesh.facets[label]
    nodes = np.unique(mesh.facets[label])
    rank = np.unique(np.asarray(moduli)[part_of_facets(mesh, facets)], return_inverse=True)[1] if len(moduli) else 0
    keys, column = np.unique(facets * (np.max(rank) + 1) + np.reshape(rank, (-1, 1)), return_inverse=True)
    column = column.reshape(facets.shape)
    bary, w = quadrature(mesh.dim - 1, _TRACTION_DEGREE)
    measure = mesh.facet_element.surface_measure(mesh.points[facets], bary) * (w * thickness)
    shape = mesh.facet_element.shape(bary)
    mass = np.einsum("mq,qi,qj->mij", measure, shape, shape)
    load = np.zeros(len(keys))
    area = 0.0
    for facet, values in _integrals(mesh, facets, boxes, (measure @ shape) / thickness):
        np.add.at(load, column[facet], values)
        area += float(values.sum())
    wanted = float(np.prod(boxes[:, 1] - boxes[:, 0], axis=1).sum())
    if not area >= _LEAST_BOX_COVERAGE * wanted:
        raise Finger3dError(f"{100.0 * (1.0 - area / wanted):.3g} % of it is not on the face {label}")
    row = np.broadcast_to(np.searchsorted(nodes, facets)[:, :, None], mass.shape)

    def assembled(columns: Int, size: int) -> sp.csc_matrix:
        wide = np.broadcast_to(columns[:, None, :], mass.shape)
        return sp.csc_matrix((mass.ravel(), (row.ravel(), wide.ravel())), shape=(len(nodes), size))

    continuous = assembled(np.searchsorted(nodes, facets), len(nodes))
    weights = np.zeros(len(mesh.points))
    if len(keys) == len(nodes) or not mesh.facet_element.is_quadratic:
        folded = np.bincount(np.searchsorted(nodes, keys // (np.max(rank) + 1)), load, minlength=len(nodes))
        weights[nodes] = splu(continuous).solve(folded / area)
        return weights
    basis = _linear_beside_stiffer(facets, column, np.reshape(rank, (-1, 1)), mesh)
    jumping = assembled(column, len(keys)) @ basis
    normal = sp.block_array([[continuous, jumping], [jumping.T, None]], format="csc")
    right = np.concatenate([np.zeros(len(nodes)), basis.T @ load / area])
    weights[nodes] = splu(normal).solve(right)[: len(nodes)]
    return weights


def _linear_beside_stiffer(facets: Int, column: Int, rank: Int, mesh: Mesh) -> sp.csr_matrix:
    """Return nodal values (k, u) by the unknowns of a traction that is linear beside stiffer parts.

    Parameters
    ----------
    facets, column : (m, nodes of a facet) node and number of its nodal value
    rank : (m, 1) of the facet's stiffness
    """
    stiffest = np.zeros(len(mesh.points), dtype=np.int64)
    np.maximum.at(stiffest, facets, np.broadcast_to(rank, facets.shape))
    element = mesh.facet_element
    soft = rank < stiffest[facets[:, : element.dim + 1]]
    start, stop = element.edges.T
    along = soft[:, start] | soft[:, stop]
    middle = column[:, element.dim + 1 :][along]
    ends = np.stack([column[:, start][along], column[:, stop][along]], axis=1)
    middle, first = np.unique(middle, return_index=True)
    size = column.max() + 1
    independent = np.setdiff1d(np.arange(size), middle)
    unknown = np.full(size, -1)
    unknown[independent] = np.arange(len(independent))
    rows = np.concatenate([independent, middle.repeat(2)])
    values = np.concatenate([np.ones(len(independent)), np.full(2 * len(middle), 0.5)])
    columns = np.concatenate([unknown[independent], unknown[ends[first]].ravel()])
    return sp.csr_matrix((values, (rows, columns)), shape=(size, len(independent)))


def _integrals(mesh: Mesh, facets: Int, boxes: Float, whole: Float) -> list[tuple[int, Float]]:
    """Return the integrals (nodes,) of the shape functions over the part of each facet in boxes, with its number.

    `whole` (m, nodes) are the integrals over whole facets.
    """
    element = mesh.facet_element
    across = [0] if mesh.dim == 2 else [0, 2]
    bary, w = quadrature(mesh.dim - 1, _TRACTION_DEGREE)
    corners = mesh.points[facets[:, : mesh.dim]][:, :, across]
    integrals: list[tuple[int, Float]] = []
    for low, high in boxes:
        inside = ((corners >= low) & (corners <= high)).all(axis=(1, 2))
        apart = ((corners.max(axis=1) <= low) | (corners.min(axis=1) >= high)).any(axis=1)
        integrals += [(int(k), whole[k]) for k in np.flatnonzero(inside)]
        for k in np.flatnonzero(~inside & ~apart):
            for piece in _pieces(corners[k], low, high):
                places = bary @ piece
                measure = (
                    abs(float(np.linalg.det(piece))) * element.surface_measure(mesh.points[facets[k]][None], places)[0]
                )
                integrals.append((int(k), (w * measure) @ element.shape(places)))
    return integrals


def _pieces(corners: Float, low: Float, high: Float) -> list[Float]:
    """Return simplices (d, d), barycentric, of the part of a facet with corners (d, d - 1) that lies within bounds."""
    polygon = np.eye(len(corners))
    for distance in (*(corners - low).T, *(high - corners).T):
        value = polygon @ distance
        kept = []
        for i, point in enumerate(polygon):
            j = (i + 1) % len(polygon)
            if value[i] >= 0.0:
                kept.append(point)
            if value[i] * value[j] < 0.0:
                kept.append(point + value[i] / (value[i] - value[j]) * (polygon[j] - point))
        if len(kept) < len(corners):
            return []
        polygon = np.array(kept)
    if len(corners) == 2:
        return [polygon[[np.argmin(polygon[:, 0]), np.argmax(polygon[:, 0])]]]
    return [polygon[[0, k, k + 1]] for k in range(1, len(polygon) - 1)]
