"""Mean traction of a support on a face, from the nodal forces that hold it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from finger3d._types import Float, Int
from finger3d.errors import Finger3dError
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.simplex import Mesh, part_of_facets

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
