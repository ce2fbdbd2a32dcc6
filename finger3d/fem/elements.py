"""Simplex shape functions and quadrature in barycentric form: one text for edges, triangles and tetrahedra."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from finger3d.fem.simplex import EDGES

Float = NDArray[np.float64]

_CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def shape(bary: Float, quadratic: bool) -> Float:
    """Shape functions (q, k) at barycentric points (q, d + 1), nodes in VTK order."""
    if not quadratic:
        return bary
    i, j = EDGES[bary.shape[1] - 1].T
    return np.hstack([bary * (2.0 * bary - 1.0), 4.0 * bary[:, i] * bary[:, j]])


def gradient(bary: Float, quadratic: bool) -> Float:
    """Derivatives (q, k, d) of the shape functions along the reference axes (barycentric 1..d)."""
    q, corners = bary.shape
    axes = np.vstack([-np.ones(corners - 1), np.eye(corners - 1)])  # d(barycentric)/d(reference)
    if not quadratic:
        return np.broadcast_to(axes, (q, corners, corners - 1))
    i, j = EDGES[corners - 1].T
    vertex = (4.0 * bary - 1.0)[:, :, None] * axes
    middle = 4.0 * (bary[:, i, None] * axes[j] + bary[:, j, None] * axes[i])
    return np.concatenate([vertex, middle], axis=1)


@cache
def quadrature(dim: int, degree: int) -> tuple[Float, Float]:
    """Barycentric points (q, dim + 1) and weights (q,) that sum to the reference simplex's volume 1/dim!.

    In 1D it is Gauss and Legendre's rule. Degree 2 in 2D and 3D are the symmetric 3- and 4-point rules (Strang and Fix
    1973), degree 5 in 2D is Radon's symmetric 7-point rule (1948); anything else is a Gauss-Jacobi product on the
    collapsed square or cube (Stroud 1971), positive and of any degree, but not symmetric.
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


def jacobians(nodes: Float, reference: Float) -> Float:
    """Jacobians (e, q, D, d) of cells with node coordinates (e, k, D), from reference gradients (q, k, d)."""
    return np.einsum("ekD,qkd->eqDd", nodes, reference, optimize=True)


def physical_gradients(nodes: Float, bary: Float, quadratic: bool) -> tuple[Float, Float]:
    """Gradients (e, q, k, d) in space, 1/mm, and Jacobian determinants (e, q), for cells with nodes (e, k, d)."""
    reference = gradient(bary, quadratic)
    inverse, determinant = _inverted(jacobians(nodes, reference))
    return reference @ inverse, determinant


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


def surface_measure(nodes: Float, bary: Float, quadratic: bool) -> Float:
    """Length or area factor (m, q) of facets with nodes (m, k, d): sqrt(det J^T J)."""
    jacobian = jacobians(nodes, gradient(bary, quadratic))
    metric = np.swapaxes(jacobian, -1, -2) @ jacobian
    return np.sqrt(np.linalg.det(metric))
