"""Stiffness of linear isotropic elasticity, displacement or mixed, in 2D and 3D by the same text.

Displacement form: ``lam div(u) div(v) + 2 G eps(u):eps(v)``.  Mixed form (Taylor-Hood, quadratic u and linear p):
``2 G eps(u):eps(v) + p div(v) + q div(u) - p q / lam`` with p = lam div(u), which stays finite at nu = 0.5.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d.fem.elements import physical_gradients, quadrature, shape
from finger3d.mesh import Mesh

Float = NDArray[np.float64]
Int = NDArray[np.int64]

MIXED_FROM = 0.48
"""Poisson's ratio from which the mixed form is used (linear elements lock, and the pressure of quadratic ones
oscillates, design.md sec. 5)."""

# The compressibility 1/lam never falls below this share of 1/G: it keeps every pivot away from zero at nu = 0.5,
# where it changes results by about 1e-7 (relative), below any mesh error.
_LEAST_COMPRESSIBILITY = 1e-7

_CHUNK = 2048


@dataclass(frozen=True)
class Elasticity:
    """Lame constants (MPa) as the assembled form uses them, for a state of 2D or 3D strain."""

    shear: float
    lame: float
    mixed: bool

    @classmethod
    def of(cls, E_MPa: float, nu: float, plane_stress: bool = False, mixed: bool | None = None) -> Elasticity:
        """From Young's modulus and Poisson's ratio; plane stress condenses the thickness strain into `lame`."""
        shear = E_MPa / (2.0 * (1.0 + nu))
        if plane_stress:
            return cls(shear, E_MPa * nu / (1.0 - nu**2), False)
        compressibility = (
            max((1.0 - 2.0 * nu) * (1.0 + nu) / (E_MPa * nu), _LEAST_COMPRESSIBILITY / shear) if nu else np.inf
        )
        return cls(shear, 1.0 / compressibility, nu >= MIXED_FROM if mixed is None else mixed)


@dataclass(frozen=True)
class Stiffness:
    """Upper triangle of the stiffness, and how its unknowns are numbered.

    Attributes
    ----------
    upper : (N, N) csr, N/mm
        Unknown ``node * d + axis``, then scaled pressures in the mixed form.  Every diagonal entry is stored.
    pressure_scale : MPa
        Pressure unknowns are in this unit, so that all entries are of one size.
    """

    upper: sp.csr_matrix
    pressure_vertices: Int
    pressure_scale: float

    def less(self, part: sp.csr_matrix) -> Stiffness:
        """The stiffness less a symmetric matrix (m, m) on its first unknowns, whose entries it must have places for."""
        upper = self.upper.copy()
        upper.data = upper.data - on_places(sp.triu(part, format="csr"), upper)
        return replace(self, upper=upper)


def on_places(matrix: sp.csr_matrix, places: sp.csr_matrix) -> Float:
    """Values (nnz,) of a matrix on the entries of another that has all of its, in sorted rows of the same width."""
    wide = places.shape[1]
    rows = np.repeat(np.arange(places.shape[0]), np.diff(places.indptr))
    found = matrix.tocoo()
    at = np.searchsorted(rows * wide + places.indices, found.row.astype(np.int64) * wide + found.col)
    out = np.zeros(places.nnz)
    np.add.at(out, at, found.data)
    return out


@dataclass(frozen=True)
class Pattern:
    """Where the cells' node-node blocks go in the upper triangle; one per mesh, for any number of assemblies.

    Attributes
    ----------
    slot : (e, pairs) number of the block of every local pair a <= b
    row, col : (blocks,) node numbers, row <= col
    local : the local pairs, as two index arrays (pairs,)
    swapped : (e, pairs) whether a pair's nodes stand the other way round in the matrix
    """

    slot: Int
    row: Int
    col: Int
    local: tuple[Int, Int]
    swapped: NDArray[np.bool_]

    @classmethod
    def of(cls, mesh: Mesh, linked: tuple[Int, Int] | None = None) -> Pattern:
        """Find the pattern of a mesh, with places for `linked` pairs of nodes that no cell joins."""
        count = len(mesh.points)
        a, b = np.triu_indices(mesh.cells.shape[1])
        first, second = mesh.cells[:, a], mesh.cells[:, b]
        key = np.minimum(first, second) * count + np.maximum(first, second)
        also = np.minimum(*linked) * count + np.maximum(*linked) if linked else np.zeros(0, dtype=np.int64)
        unique, slot = np.unique(np.concatenate([key.ravel(), also]), return_inverse=True)
        return cls(slot[: key.size].reshape(key.shape), unique // count, unique % count, (a, b), first > second)

    def add(self, blocks: Float, part: slice, cell: Float) -> None:
        """Add the blocks (e, k, k, d, d) of some cells to `blocks` (blocks, d, d)."""
        upper = cell[:, self.local[0], self.local[1]]
        turn = self.swapped[part]
        upper[turn] = np.swapaxes(upper[turn], 1, 2)
        np.add.at(blocks, self.slot[part].ravel(), upper.reshape(-1, *blocks.shape[1:]))

    def upper(self, blocks: Float, nodes: int) -> sp.csr_matrix:
        """Upper triangle (nodes d, nodes d) of the matrix that the blocks (blocks, d, d) make up, zeros kept."""
        d = blocks.shape[1]
        starts = np.searchsorted(self.row, np.arange(nodes + 1))
        whole = sp.bsr_matrix((blocks, self.col, starts), shape=(nodes * d, nodes * d)).tocsr()
        rows = np.repeat(np.arange(nodes * d, dtype=whole.indices.dtype), np.diff(whole.indptr))
        keep = whole.indices >= rows  # a diagonal block has entries below the diagonal too
        kept = np.concatenate([[0], np.cumsum(keep)])[whole.indptr]
        return sp.csr_matrix((whole.data[keep], whole.indices[keep], kept), shape=whole.shape)


def _cell_blocks(gradients: Float, weights: Float, elastic: Elasticity, lame: float) -> Float:
    """Element stiffness blocks (e, k, k, d, d) from gradients (e, q, k, d) and weights (e, q)."""
    e, q, k, d = gradients.shape
    flat = gradients.reshape(e, q, k * d)
    outer = np.matmul(np.swapaxes(flat * weights[:, :, None], 1, 2), flat).reshape(e, k, d, k, d)
    outer = outer.transpose(0, 1, 3, 2, 4)  # (e, a, b, i, j) = sum_q w G_ai G_bj
    blocks = elastic.shear * np.swapaxes(outer, 3, 4)
    if lame:
        blocks = blocks + lame * outer
    laplace = elastic.shear * np.einsum("eabii->eab", outer)
    for i in range(d):
        blocks[..., i, i] += laplace
    return blocks


def stiffness(mesh: Mesh, elastic: Elasticity, thickness: float = 1.0) -> Stiffness:
    """Assemble the upper triangle.

    Parameters
    ----------
    mesh : linear or quadratic mesh
    elastic : constants; `mixed` needs a quadratic mesh
    thickness : mm
        Width of a 2D section (1 for a solid), so that forces are N.
    """
    n, d = mesh.points.shape
    bary, w = quadrature(d, 2 if mesh.is_quadratic else 1)
    pattern = Pattern.of(mesh)
    blocks = np.zeros((len(pattern.row), d, d))
    hats = shape(bary, False)
    p_blocks, masses = [], []
    lame = 0.0 if elastic.mixed else elastic.lame
    for start in range(0, len(mesh.cells), _CHUNK):
        part = slice(start, start + _CHUNK)
        gradients, det = physical_gradients(mesh.points[mesh.cells[part]], bary, mesh.is_quadratic)
        weights = det * (w * thickness)
        pattern.add(blocks, part, _cell_blocks(gradients, weights, elastic, lame))
        if elastic.mixed:
            p_blocks.append(np.einsum("eq,qp,eqkd->epkd", weights, hats, gradients, optimize=True))
            masses.append(np.einsum("eq,qp,qr->epr", weights, hats, hats, optimize=True))
    matrix = pattern.upper(blocks, n)
    vertices = np.zeros(0, dtype=np.int64)
    scale = 1.0
    if elastic.mixed:
        vertices, scale = mesh.vertices, pressure_scale(mesh, elastic.shear)
        coupling, mass = scale * np.concatenate(p_blocks), -(scale**2) / elastic.lame * np.concatenate(masses)
        matrix = bordered(matrix, pressure_entries(mesh, coupling, mass, vertices), n * d + len(vertices))
    return Stiffness(matrix, vertices, scale)


def pressure_scale(mesh: Mesh, shear: float) -> float:
    """Unit (MPa) of the pressure unknowns in which their entries are of the size of the displacements'."""
    return float(shear * len(mesh.cells) ** (1.0 / mesh.dim) / np.ptp(mesh.points, axis=0).max())


def bordered(matrix: sp.csr_matrix, entries: list[tuple[Float, Int, Int]], size: int) -> sp.csr_matrix:
    """Matrix (size, size) with further columns and rows after those of a matrix (m, m).

    Parameters
    ----------
    entries : values, rows and columns from m on; repeated ones add up, zeros are kept
    """
    data, rows, cols = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    beside = sp.csr_matrix((data, (rows, cols)), shape=(size, size))
    starts = np.concatenate([matrix.indptr, np.full(size - matrix.shape[0], matrix.indptr[-1])])
    own, more = np.diff(starts), np.diff(beside.indptr)
    # every further column comes after the matrix's own, so that rows are joined end to end
    at_own = np.arange(matrix.nnz) + np.repeat(beside.indptr[:-1], own)
    at_more = np.arange(beside.nnz) + np.repeat(starts[1:], more)
    values, indices = np.empty(matrix.nnz + beside.nnz), np.empty(matrix.nnz + beside.nnz, dtype=matrix.indices.dtype)
    values[at_own], values[at_more] = matrix.data, beside.data
    indices[at_own], indices[at_more] = matrix.indices, beside.indices
    return sp.csr_matrix((values, indices, starts + beside.indptr), shape=(size, size))


def pressure_entries(mesh: Mesh, coupling: Float, mass: Float, vertices: Int) -> list[tuple[Float, Int, Int]]:
    """Entries above the diagonal of cell couplings (e, p, k, d) of u with p, and of cell blocks (e, p, p) of p."""
    n, d = mesh.points.shape
    number = np.full(n, -1)
    number[vertices] = n * d + np.arange(len(vertices))
    pressures = number[mesh.cells[:, : d + 1]]
    dof = mesh.cells[:, :, None] * d + np.arange(d)
    rows = np.broadcast_to(dof[:, None], coupling.shape)
    cols = np.broadcast_to(pressures[:, :, None, None], coupling.shape)
    r = np.broadcast_to(pressures[:, :, None], mass.shape)
    c = np.broadcast_to(pressures[:, None, :], mass.shape)
    upper = r <= c
    return [(coupling.ravel(), rows.ravel(), cols.ravel()), (mass[upper], r[upper], c[upper])]
