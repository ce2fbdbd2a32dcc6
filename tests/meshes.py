"""Small structured meshes and loads that tests compare with."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.assembly import Stiffness, stiffness
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh.elements import Element, quadrature
from finger3d.fem.mesh.quality import curved_volume
from finger3d.fem.mesh.simplex import FACETS, Mesh, boundary, quadratic, signed_volumes
from finger3d.fem.solvers import mumps, pardiso
from finger3d.fem.surface.traces import local_rows, strain_row, surface
from finger3d.objects import vertical_frame

SOLVERS = ["superlu", *(["pardiso"] if pardiso.available() else []), *(["mumps"] if mumps.available() else [])]
"""Solvers of a condensation that are installed."""


def grid(counts: tuple[int, ...], shuffle: float = 0.0, seed: int = 0) -> Mesh:
    """Linear Kuhn mesh of the unit square or cube; interior nodes moved at random by `shuffle` of a cell."""
    d = len(counts)
    axes = [np.linspace(0.0, 1.0, n + 1) for n in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, d)
    strides = np.array([np.prod([n + 1 for n in counts[i + 1 :]]) for i in range(d)], dtype=np.int64)
    low = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), axis=-1).reshape(-1, d) @ strides
    cells = []
    for order in itertools.permutations(range(d)):
        path = np.concatenate([[0], np.cumsum(strides[list(order)])])
        cells.append(low[:, None] + path)
    corners = np.vstack(cells)
    turned = signed_volumes(Mesh(points, corners, {})) < 0
    corners[turned] = corners[turned][:, [1, 0, *range(2, d + 1)]]
    mesh = Mesh(points, corners, {})
    inside = np.all((points > 0) & (points < 1), axis=1)
    step = np.random.default_rng(seed).uniform(-shuffle, shuffle, points.shape) / np.array(counts)
    moved = points + step * inside[:, None]
    outer = boundary(mesh.cells, d)
    facets = {}
    for axis, side in itertools.product(range(d), (0.0, 1.0)):
        on = np.all(points[outer][:, :, axis] == side, axis=1)
        facets["xyz"[axis] + ("-" if side == 0.0 else "+")] = outer[on]
    return Mesh(moved, mesh.cells, facets)


def mapped(mesh: Mesh, function: Callable[[np.ndarray], np.ndarray]) -> Mesh:
    """Quadratic mesh with its nodes moved by a function of the points (n, d)."""
    whole = quadratic(mesh) if not mesh.element.is_quadratic else mesh
    return Mesh(function(whole.points), whole.cells, whole.facets)


def full(upper: sp.csr_matrix) -> sp.csr_matrix:
    """The symmetric matrix with this upper triangle."""
    return (upper + sp.triu(upper, 1).T).tocsr()


def held_cube(nu: float, dim: int = 3) -> tuple[Mesh, Stiffness, np.ndarray, sp.csr_matrix]:
    """A unit square or cube fixed at its base: mesh, stiffness, fixed unknowns, and rows of its top and of a strain."""
    mesh = quadratic(grid((3,) * dim, 0.2))
    held = np.unique(mesh.facets["y-"])
    fixed = (held[:, None] * dim + np.arange(dim)).ravel()
    top = surface(mesh, "y+")
    rows = sp.vstack([local_rows(top, vertical_frame(dim)), strain_row(mesh, np.full(dim, 0.4), np.eye(dim)[0])])
    return mesh, stiffness(mesh, Elasticity.of(1.0, nu)), fixed, sp.csr_matrix(rows)


def points_in(element: Element) -> np.ndarray:
    """Seven random points of an element, in barycentric coordinates."""
    return np.random.default_rng(1).dirichlet(np.ones(element.dim + 1), 7)


def body_load(mesh: Mesh, force: Callable[[np.ndarray], np.ndarray], degree: int = 6) -> np.ndarray:
    """Consistent nodal loads (n, d) of a body force."""
    bary, w = quadrature(mesh.dim, degree)
    _, det = mesh.element.physical_gradients(mesh.points[mesh.cells], bary)
    psi = mesh.element.shape(bary)
    at = np.einsum("qk,ekd->eqd", psi, mesh.points[mesh.cells])
    value = force(at.reshape(-1, mesh.dim)).reshape(at.shape)
    load = np.zeros_like(mesh.points)
    np.add.at(load, mesh.cells, np.einsum("eq,qk,eqd->ekd", det * w, psi, value))
    return load


def edge_load(mesh: Mesh, label: str, traction: Callable[[np.ndarray], np.ndarray], degree: int = 6) -> np.ndarray:
    """Consistent nodal loads (n, d) of a traction, a function of the points (q, d), on a boundary."""
    facets = mesh.facets[label]
    bary, w = quadrature(mesh.dim - 1, degree)
    weights = mesh.facet_element.surface_measure(mesh.points[facets], bary) * w
    psi = mesh.facet_element.shape(bary)
    at = np.einsum("qk,mkd->mqd", psi, mesh.points[facets])
    value = traction(at.reshape(-1, mesh.dim)).reshape(at.shape)
    load = np.zeros_like(mesh.points)
    np.add.at(load, facets, np.einsum("mq,qk,mqd->mkd", weights, psi, value))
    return load


def error_norms(mesh: Mesh, u: np.ndarray, exact: Callable, exact_slope: Callable) -> tuple[float, float]:
    """L2 norm of the error of u (n, d), and of its gradient; `exact_slope` gives (q, d, d), row the component."""
    bary, w = quadrature(mesh.dim, 6)
    gradients, det = mesh.element.physical_gradients(mesh.points[mesh.cells], bary)
    psi = mesh.element.shape(bary)
    at = np.einsum("qk,ekd->eqd", psi, mesh.points[mesh.cells]).reshape(-1, mesh.dim)
    value = np.einsum("qk,ekd->eqd", psi, u[mesh.cells]).reshape(-1, mesh.dim)
    slope = np.einsum("ekj,eqki->eqji", u[mesh.cells], gradients).reshape(-1, mesh.dim, mesh.dim)
    weight = (det * w).ravel()
    l2 = np.sqrt(np.sum(weight * np.sum((value - exact(at)) ** 2, axis=1)))
    h1 = np.sqrt(np.sum(weight * np.sum((slope - exact_slope(at)) ** 2, axis=(1, 2))))
    return float(l2), float(h1)


def interface(mesh: Mesh, first: int, second: int) -> np.ndarray:
    """Nodes (m, 3 | 6) of the quadratic facets between cells of two parts."""
    assert mesh.part is not None
    d = mesh.dim
    corners = np.sort(mesh.cells[:, FACETS[d]].reshape(-1, d), axis=1)
    owner = np.repeat(mesh.part, d + 1)
    both = set(map(tuple, corners[owner == first].tolist())) & set(map(tuple, corners[owner == second].tolist()))
    chosen = np.array(sorted(both), dtype=np.int64).reshape(-1, d)
    n = len(mesh.points)
    ends = np.sort(mesh.cells[:, mesh.element.edges].reshape(-1, 2), axis=1) @ [n, 1]
    key, where = np.unique(ends, return_index=True)
    middle = mesh.cells[:, d + 1 :].ravel()[where]
    pairs = [(0, 1)] if d == 2 else [(0, 1), (1, 2), (0, 2)]
    return np.hstack([chosen, *(middle[np.searchsorted(key, chosen[:, p] @ [n, 1])][:, None] for p in pairs)])


def part_volume(mesh: Mesh, number: int) -> float:
    """Volume (area in 2D) of the curved cells of a part."""
    return curved_volume(replace(mesh, cells=mesh.cells[mesh.part == number], part=None, part_labels=()))


def edge_lengths(mesh: Mesh, facets: str) -> tuple[Float, Float]:
    """Corners (f, 3, 3) mm of triangles on the surface, and the mean length (f,) mm of the edges of each."""
    corners = mesh.points[mesh.facets[facets][:, :3]]
    return corners, np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
