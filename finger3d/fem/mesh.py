"""Simplex meshes with labelled boundary facets: shape functions and quadrature, quality, and location of points.

Nodes are in VTK's order: vertices first, then the mid-edge nodes in the order of `Element.edges`.

Cells and facets are stored in VTK's order for quadratic elements: vertices first, then the mid-edge nodes of
edges (0,1) (1,2) (2,0) for a triangle, and (0,1) (1,2) (2,0) (0,3) (1,3) (2,3) for a tetrahedron.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from finger3d._types import Float, Int, freeze_arrays

_CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))

EDGES = {
    1: np.array([[0, 1]]),
    2: np.array([[0, 1], [1, 2], [2, 0]]),
    3: np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]),
}
"""Vertices of the edges of a simplex of dimension 1, 2, 3."""

TRIANGLES = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Nodes of the four triangles that a quadratic triangle is drawn as."""


@dataclass(frozen=True)
class Element:
    """A Lagrange element on the simplex of dimension d.

    Attributes
    ----------
    name : str
        In meshio.
    dim : int
        Dimension d of the reference simplex.
    order : int
        1 linear, 2 quadratic.
    """

    name: str
    dim: int
    order: int

    @property
    def edges(self) -> Int:
        """Vertices (edges, 2) of the edges."""
        return EDGES[self.dim]

    @property
    def is_quadratic(self) -> bool:
        """Whether edges have a node in the middle."""
        return self.order == 2

    @property
    def node_count(self) -> int:
        """Number of nodes k."""
        return self.dim + 1 + (len(self.edges) if self.is_quadratic else 0)

    @property
    def facet(self) -> Element:
        """Element of the facets."""
        return next(e for e in _ELEMENTS if (e.dim, e.order) == (self.dim - 1, self.order))

    @property
    def nodes(self) -> Float:
        """Barycentric coordinates (k, d + 1) of the nodes."""
        corners = np.eye(self.dim + 1)
        return np.vstack([corners, corners[self.edges].mean(axis=1)]) if self.is_quadratic else corners

    @property
    def mirrored(self) -> Int:
        """Order (k,) of the nodes that keeps a reflected cell positive: vertices 0 and 1 swapped."""
        swapped = self.nodes[:, [1, 0, *range(2, self.dim + 1)]]
        return np.array([np.flatnonzero((self.nodes == node).all(axis=1))[0] for node in swapped])

    def shape(self, bary: Float) -> Float:
        """Return the shape functions (q, k) at barycentric points (q, d + 1)."""
        if not self.is_quadratic:
            return bary
        i, j = self.edges.T
        return np.hstack([bary * (2.0 * bary - 1.0), 4.0 * bary[:, i] * bary[:, j]])

    def gradient(self, bary: Float) -> Float:
        """Return the derivatives (q, k, d) of the shape functions along the reference axes (barycentric 1..d)."""
        axes = np.vstack([-np.ones(self.dim), np.eye(self.dim)])  # d(barycentric)/d(reference)
        if not self.is_quadratic:
            return np.broadcast_to(axes, (len(bary), *axes.shape))
        i, j = self.edges.T
        vertex = (4.0 * bary - 1.0)[:, :, None] * axes
        middle = 4.0 * (bary[:, i, None] * axes[j] + bary[:, j, None] * axes[i])
        return np.concatenate([vertex, middle], axis=1)

    def jacobians(self, nodes: Float, bary: Float) -> Float:
        """Return the Jacobians (e, q, D, d) at barycentric points of cells with node coordinates (e, k, D)."""
        return np.asarray(np.einsum("ekD,qkd->eqDd", nodes, self.gradient(bary), optimize=True))

    def physical_gradients(self, nodes: Float, bary: Float) -> tuple[Float, Float]:
        """Return gradients (e, q, k, d) in space, 1/mm, and Jacobian determinants (e, q), of cells (e, k, d)."""
        inverse, determinant = _inverted(self.jacobians(nodes, bary))
        return self.gradient(bary) @ inverse, determinant

    def surface_measure(self, nodes: Float, bary: Float) -> Float:
        """Return the length or area factor (m, q) of facets with nodes (m, k, D): sqrt(det J^T J)."""
        jacobian = self.jacobians(nodes, bary)
        return np.asarray(np.sqrt(np.linalg.det(np.swapaxes(jacobian, -1, -2) @ jacobian)))


LINE2, LINE3 = Element("line", 1, 1), Element("line3", 1, 2)
TRI3, TRI6 = Element("triangle", 2, 1), Element("triangle6", 2, 2)
TET4, TET10 = Element("tetra", 3, 1), Element("tetra10", 3, 2)

_ELEMENTS = (LINE2, LINE3, TRI3, TRI6, TET4, TET10)
_BY_SIZE = {(e.dim, e.node_count): e for e in _ELEMENTS}


def element_of(dim: int, node_count: int) -> Element:
    """Return the element of a dimension and a number of nodes."""
    return _BY_SIZE[dim, node_count]


@cache
def quadrature(dim: int, degree: int) -> tuple[Float, Float]:
    """Barycentric points (q, dim + 1) and weights (q,) that sum to the reference simplex's volume 1/dim!.

    In 1D it is Gauss and Legendre's rule. Degree 2 in 2D and 3D are the symmetric 3- and 4-point rules (Strang and Fix
    1973), degree 3 in 3D is Keast's 5-point rule (1986), whose weight at the centre is negative, and degree 5 in 2D is
    Radon's symmetric 7-point rule (1948).  Other degrees have no rule in 2D and 3D.
    """
    if dim == 1:
        x, w = np.polynomial.legendre.leggauss(degree // 2 + 1)
        return np.stack([(1.0 - x) / 2.0, (1.0 + x) / 2.0], axis=1), w / 2.0
    if degree == 2:
        a = 2.0 / 3.0 if dim == 2 else (5.0 + 3.0 * math.sqrt(5.0)) / 20.0
        b = (1.0 - a) / dim
        weight = 1.0 / math.factorial(dim + 1)
        return np.full((dim + 1, dim + 1), b) + (a - b) * np.eye(dim + 1), np.full(dim + 1, weight)
    if degree == 5 and dim == 2:
        root = math.sqrt(15.0)
        orbits = [(6.0 - root) / 21.0, (6.0 + root) / 21.0]
        points = [np.full((1, 3), 1.0 / 3.0), *[np.full((3, 3), a) + (1.0 - 3.0 * a) * np.eye(3) for a in orbits]]
        values = [9.0 / 80.0, *[(155.0 - root) / 2400.0] * 3, *[(155.0 + root) / 2400.0] * 3]
        return np.vstack(points), np.array(values)
    if degree == 3 and dim == 3:
        ends = np.full((4, 4), 1.0 / 6.0) + np.eye(4) / 3.0
        return np.vstack([np.full((1, 4), 0.25), ends]), np.array([-2.0 / 15.0] + [3.0 / 40.0] * 4)
    raise ValueError(f"no rule of degree {degree} for a simplex of dimension {dim}")


def _inverted(matrix: Float) -> tuple[Float, Float]:
    """Inverses and determinants of matrices (e, q, d, d), d = 2 or 3, by cofactors: LAPACK takes thrice as long."""
    m = np.ascontiguousarray(np.moveaxis(matrix, (2, 3), (0, 1)))
    if len(m) == 2:
        adjugate = np.array([[m[1, 1], -m[0, 1]], [-m[1, 0], m[0, 0]]])
    else:
        adjugate = np.empty_like(m)
        for i, p, q in _CYCLES:
            for j, r, s in _CYCLES:
                adjugate[j, i] = m[p, r] * m[q, s] - m[p, s] * m[q, r]
    determinant = (m[0] * adjugate[:, 0]).sum(axis=0)
    return np.moveaxis(adjugate / determinant, (0, 1), (2, 3)), determinant


FACETS = {
    2: np.array([[0, 1], [1, 2], [2, 0]]),
    3: np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]),
}
"""Facets of a simplex, oriented outward for a positive cell."""

FREE_FACES = ("contact", "walls", "ends")
"""Labels of the faces that may touch an object; a contact point knows the number of its own."""

CONTACT = 0
"""Number of the contact face."""


@dataclass(frozen=True, repr=False)
class Mesh:
    """A mesh of simplices.

    Attributes
    ----------
    points : (n, d) mm
    cells : (e, d + 1) linear, or (e, 6 | 10) quadratic, node numbers in VTK order
    facets : label -> (m, d) linear, or (m, 3 | 6) quadratic boundary facets, oriented outward
        Labels in use: contact, base, ends, walls, symmetry_x, symmetry_z.
    part : (e,) number of the part that each cell belongs to, 0 for the main body; None: there is no other part
    part_labels : labels of parts 1, 2, ...
    """

    points: Float
    cells: Int
    facets: Mapping[str, Int]
    part: Int | None = None
    part_labels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __repr__(self) -> str:
        """One line: the arrays would fill pages."""
        kind = "quadratic" if self.element.is_quadratic else "linear"
        labels = ", ".join(f"{label} {len(facets)}" for label, facets in self.facets.items())
        parts = f"; parts: {', '.join(self.part_labels)}" if self.part_labels else ""
        return (
            f"<Mesh of {len(self.cells)} {kind} cells, {len(self.points)} points, {self.dim}D; facets: {labels}{parts}>"
        )

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.points.shape[1])

    @property
    def element(self) -> Element:
        """Element of the cells."""
        return element_of(self.dim, self.cells.shape[1])

    @property
    def facet_element(self) -> Element:
        """Element of the facets."""
        return self.element.facet

    @property
    def vertices(self) -> Int:
        """Numbers of the corner nodes, ascending."""
        return np.unique(self.cells[:, : self.dim + 1])

    @cached_property
    def part_corners(self) -> tuple[Int, Int]:
        """Nodes (v,) at the corners of cells, and the number (e, d + 1) of each cell's corners among them.

        A node on an interface counts once in every part that it belongs to, so that fields over these corners may be
        discontinuous there.  They are sorted by part, then by node.
        """
        corners = self.cells[:, : self.dim + 1]
        of = np.zeros(len(corners), dtype=np.int64) if self.part is None else self.part
        keys, corner = np.unique(of[:, None] * len(self.points) + corners, return_inverse=True)
        return keys % len(self.points), corner.reshape(corners.shape)

    @cached_property
    def boxes(self) -> tuple[Float, Float]:
        """Lowest and highest coordinates (e, d) of a box around each cell, with room for a curved facet."""
        nodes = self.points[self.cells]
        low, high = nodes.min(axis=1), nodes.max(axis=1)
        slack = 0.05 * (high - low).max(axis=1, keepdims=True)
        return low - slack, high + slack

    @cached_property
    def by_part(self) -> tuple[MeshPart, ...]:
        """The parts that have cells, each as a mesh of its own."""
        if self.part is None:
            everything = np.arange(len(self.points)), np.arange(len(self.cells))
            return (MeshPart(0, self, *everything, slice(None)),)
        parts = []
        first = 0
        for number in np.unique(self.part):
            cells = np.flatnonzero(self.part == number)
            nodes, local = np.unique(self.cells[cells], return_inverse=True)
            mesh = Mesh(self.points[nodes], local.reshape(len(cells), -1), {})
            last = first + len(mesh.vertices)
            parts.append(MeshPart(int(number), mesh, nodes, cells, slice(first, last)))
            first = last
        return tuple(parts)


@dataclass(frozen=True)
class MeshPart:
    """One part of a body as a mesh of its own.

    Attributes
    ----------
    number : of the part
    mesh : the cells of the part
    nodes : (n',) nodes of the whole mesh
    cells : (e',) cells of the whole mesh
    corners : slice of the part's corners among `Mesh.part_corners` of the whole mesh
    """

    number: int
    mesh: Mesh
    nodes: Int
    cells: Int
    corners: slice

    def __post_init__(self) -> None:
        freeze_arrays(self)


def boundary(cells: Int, dim: int) -> Int:
    """Facets (m, dim) of linear cells that belong to one cell only, oriented outward."""
    faces = cells[:, FACETS[dim]].reshape(-1, dim)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[count == 1])])


def part_of_facets(mesh: Mesh, facets: Int) -> Int:
    """Numbers (m,) of the parts that boundary facets belong to."""
    d = mesh.dim
    if mesh.part is None:
        return np.zeros(len(facets), dtype=np.int64)
    faces = np.sort(mesh.cells[:, FACETS[d]].reshape(-1, d), axis=1)
    _, number = np.unique(np.vstack([faces, np.sort(facets[:, :d], axis=1)]), axis=0, return_inverse=True)
    part = np.zeros(number.max() + 1, dtype=np.int64)
    part[number[: len(faces)]] = np.repeat(mesh.part, d + 1)
    return part[number[len(faces) :]]


def signed_volumes(mesh: Mesh) -> Float:
    """Signed volume (area in 2D) (e,) of the straight cells, mm^d."""
    corners = mesh.points[mesh.cells[:, : mesh.dim + 1]]
    edges = corners[:, 1:] - corners[:, :1]
    return np.asarray(np.linalg.det(edges) / (2.0 if mesh.dim == 2 else 6.0))


def quadratic(mesh: Mesh) -> Mesh:
    """Add a node in the middle of every edge of a linear mesh; the new nodes follow the old ones.

    The midpoints lie on the chords; a caller that knows the surface moves them onto it.
    """
    d, n = mesh.dim, len(mesh.points)
    pairs = np.sort(mesh.cells[:, EDGES[d]], axis=2)
    key = pairs[..., 0] * n + pairs[..., 1]
    edge_keys, number = np.unique(key, return_inverse=True)
    ends = np.stack([edge_keys // n, edge_keys % n], axis=1)
    mids = mesh.points[ends].mean(axis=1)

    def mid_nodes(simplices: Int, edges: Int) -> Int:
        ordered = np.sort(simplices[:, edges], axis=2)
        return n + np.searchsorted(edge_keys, ordered[..., 0] * n + ordered[..., 1])

    facets = {label: np.zeros((0, 3 if d == 2 else 6), dtype=np.int64) for label in mesh.facets}
    facets |= {label: np.hstack([f, mid_nodes(f, EDGES[d - 1])]) for label, f in mesh.facets.items() if len(f)}
    cells = np.hstack([mesh.cells, n + number.reshape(key.shape)])
    return replace(mesh, points=np.vstack([mesh.points, mids]), cells=cells, facets=facets)


def reflected(mesh: Mesh, axis: int) -> Mesh:
    """The mirror image of a mesh about ``x[axis] = 0``, its cells kept positive."""
    points = mesh.points.copy()
    points[:, axis] *= -1.0
    of_cell, of_facet = mesh.element.mirrored, mesh.facet_element.mirrored
    facets = {label: f[:, of_facet] for label, f in mesh.facets.items()}
    return replace(mesh, points=points, cells=mesh.cells[:, of_cell], facets=facets)


def side_by_side(mesh: Mesh, other: Mesh) -> Mesh:
    """Two meshes with the same parts as one; the nodes of the second follow those of the first."""
    n = len(mesh.points)
    facets = {label: np.vstack([f, other.facets[label] + n]) for label, f in mesh.facets.items()}
    part = None if mesh.part is None or other.part is None else np.concatenate([mesh.part, other.part])
    cells = np.vstack([mesh.cells, other.cells + n])
    return replace(mesh, points=np.vstack([mesh.points, other.points]), cells=cells, facets=facets, part=part)


def axis_numbers(axes: Iterable[str]) -> tuple[int, ...]:
    """Return the numbers of the axes named "x", "y" and "z"."""
    return tuple("xyz".index(axis) for axis in axes)


def in_symmetry_planes(vectors: Float, points: Float, axes: Iterable[str]) -> Float:
    """Return vectors (c, d) at points (c, d), without the component across a symmetry plane that they lie on."""
    out = vectors.copy()
    for k in axis_numbers(axes):
        out[points[:, k] == 0.0, k] = 0.0
    return out


def reflect_into_part(point: Float, direction: Float, axes: tuple[str, ...], dim: int) -> tuple[Float, Float]:
    """Return a place and a direction (3,) in the meshed part (d,), reflected if they lie in a mirror image."""
    sign = np.array([-1.0 if a in axes and v < 0.0 else 1.0 for a, v in zip("xyz", point, strict=True)])
    return (point * sign)[:dim], (direction * sign)[:dim]


def in_space(vectors: Float) -> Float:
    """Return vectors (n, d) as (n, 3)."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def signs_into_part(points: Float, axes: Iterable[str]) -> Float:
    """Return the factors (p, d), 1 or -1, that reflect points (p, d) into the meshed part."""
    sign = np.ones_like(points)
    for k in axis_numbers(axes):
        sign[points[:, k] < 0.0, k] = -1.0
    return sign


def unfold(mesh: Mesh, axes: tuple[int, ...]) -> tuple[Mesh, Int, Float]:
    """Mirror a half or quarter mesh about the planes ``x[axis] = 0``.

    Returns
    -------
    whole : Mesh
    parent : (n,) number of the node of `mesh` that each node of `whole` is an image of
    sign : (n, d) what a vector at the parent is multiplied with, +1 or -1
    """
    parent = np.arange(len(mesh.points))
    sign = np.ones_like(mesh.points)
    for axis in axes:
        n = len(mesh.points)
        off = np.abs(mesh.points[:, axis]) > 0.0
        image = np.where(off, n + np.cumsum(off) - 1, np.arange(n))
        other = reflected(mesh, axis)
        kept = {label: f for label, f in mesh.facets.items() if label != "symmetry_" + "xyz"[axis]}
        facets = {label: np.vstack([f, image[other.facets[label]]]) for label, f in kept.items()}
        cells = np.vstack([mesh.cells, image[other.cells]])
        part = None if mesh.part is None else np.tile(mesh.part, 2)
        points = np.vstack([mesh.points, other.points[off]])
        mesh = replace(mesh, points=points, cells=cells, facets=facets, part=part)
        parent = np.concatenate([parent, parent[off]])
        sign = np.vstack([sign, np.where(np.arange(sign.shape[1]) == axis, -sign[off], sign[off])])
    return mesh, parent, sign


def middles(facets: Int, dim: int) -> tuple[Int, Int]:
    """Ends (k, 2) of the edges of quadratic facets of a d-dimensional mesh, and the nodes (k,) at their middles.

    Contact is known at vertices only, and is interpolated at these nodes; linear facets have none.
    """
    element = element_of(dim - 1, facets.shape[1])
    edges = element.edges if element.is_quadratic else np.zeros((0, 2), dtype=np.int64)
    return facets[:, edges].reshape(-1, 2), facets[:, dim:].ravel()


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
    middle = np.full((1, mesh.dim + 1), 1.0 / (mesh.dim + 1))
    return np.asarray(_determinants(mesh, np.vstack([mesh.element.nodes, middle])).min(axis=0))


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


_NEWTON_ITERATIONS = 8
"""Newton iterations on a quadratic element; the map of a linear one is inverted exactly by the first."""

_SETTLED = 1e-9
"""Largest step, in barycentric coordinates, of the last iteration: the next would be of the order of its square."""

_INSIDE = -1e-6
"""Least barycentric coordinate of a point that counts as inside a cell."""

_NEAREST_CELLS = {2: 12, 3: 100}
"""Cells with the nearest centroids, by dimension, that may hold a point; in graded solids 40 are too few."""


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
    low, high = mesh.boxes
    best = np.full(len(points), -np.inf)
    where = np.full((len(points), d + 1), 1.0 / (d + 1))
    cell = np.full(len(points), -1)
    for k in range(count):
        left = np.flatnonzero(best < _INSIDE)
        if not len(left):
            break
        at, there = points[left], near[left, k]
        left = left[((at >= low[there]) & (at <= high[there])).all(axis=1)]
        bary = inverse_map(mesh.element, corners[near[left, k]], points[left])
        least = bary.min(axis=1)
        better = least > best[left]
        where[left[better]], cell[left[better]] = bary[better], near[left[better], k]
        best[left[better]] = least[better]
    cell[best < _INSIDE] = -1
    return cell, where
