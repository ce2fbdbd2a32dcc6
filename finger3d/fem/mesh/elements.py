"""Simplex elements: shape functions, isoparametric geometry and quadrature, in barycentric coordinates.

Nodes are in VTK's order: vertices first, then the mid-edge nodes in the order of `Element.edges`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from finger3d._types import Float, Int

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
    Radon's symmetric 7-point rule (1948). Any other is a Gauss-Jacobi product on the collapsed square or cube (Stroud
    1971): positive weights, but not symmetric.
    """
    if dim == 1:
        x, w = np.polynomial.legendre.leggauss(degree // 2 + 1)
        return np.stack([(1.0 - x) / 2.0, (1.0 + x) / 2.0], axis=1), w / 2.0
    if degree == 2:
        a = 2.0 / 3.0 if dim == 2 else (5.0 + 3.0 * math.sqrt(5.0)) / 20.0
        b = (1.0 - a) / dim
        return np.full((dim + 1, dim + 1), b) + (a - b) * np.eye(dim + 1), np.full(
            dim + 1, 1.0 / math.factorial(dim + 1)
        )
    if degree == 5 and dim == 2:
        root = math.sqrt(15.0)
        orbits = [(6.0 - root) / 21.0, (6.0 + root) / 21.0]
        points = [np.full((1, 3), 1.0 / 3.0), *[np.full((3, 3), a) + (1.0 - 3.0 * a) * np.eye(3) for a in orbits]]
        values = [9.0 / 80.0, *[(155.0 - root) / 2400.0] * 3, *[(155.0 + root) / 2400.0] * 3]
        return np.vstack(points), np.array(values)
    if degree == 3 and dim == 3:
        ends = np.full((4, 4), 1.0 / 6.0) + np.eye(4) / 3.0
        return np.vstack([np.full((1, 4), 0.25), ends]), np.array([-2.0 / 15.0] + [3.0 / 40.0] * 4)
    from scipy.special import roots_jacobi

    order = degree // 2 + 1
    rules = []
    for axis in range(dim):
        x, w = roots_jacobi(order, dim - 1 - axis, 0.0)
        rules.append(((x + 1.0) / 2.0, w / 2.0 ** (dim - axis)))
    grids = np.meshgrid(*[r[0] for r in rules], indexing="ij")
    weights = np.meshgrid(*[r[1] for r in rules], indexing="ij")
    coordinates, rest = [], np.ones(order**dim)
    for g in grids:
        coordinates.append(rest * g.ravel())
        rest = rest * (1.0 - g.ravel())
    return np.stack([rest, *coordinates], axis=1), np.prod([w.ravel() for w in weights], axis=0)


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
