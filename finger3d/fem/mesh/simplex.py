"""Simplex meshes with labelled boundary facets, in two and three dimensions.

Cells and facets are stored in VTK's order for quadratic elements: vertices first, then the mid-edge nodes of
edges (0,1) (1,2) (2,0) for a triangle, and (0,1) (1,2) (2,0) (0,3) (1,3) (2,3) for a tetrahedron.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from finger3d._types import Float, Int, freeze_arrays
from finger3d.fem.mesh.elements import EDGES, Element, element_of

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

    facets = {
        label: np.hstack([f, mid_nodes(f, EDGES[d - 1])])
        if len(f)
        else np.zeros((0, 3 if d == 2 else 6), dtype=np.int64)
        for label, f in mesh.facets.items()
    }
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
        plane = "symmetry_" + "xyz"[axis]
        facets = {
            label: np.vstack([f, image[other.facets[label]]]) for label, f in mesh.facets.items() if label != plane
        }
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
