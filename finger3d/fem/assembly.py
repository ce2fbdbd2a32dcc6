"""Stiffness of linear elasticity in the displacement form or the mixed form, in two and three dimensions.

Displacement form: ``eps(v) : C : eps(u)``. Mixed form (Taylor-Hood, quadratic u and linear p):
``eps(v) : C : eps(u) + p div(v) + q div(u) - p q / lam`` with p = lam div(u), which stays finite at nu = 0.5.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.fem.laws.material import LinearElasticity
from finger3d.fem.mesh import Mesh, quadrature

AnyInt = NDArray[np.int32] | NDArray[np.int64]

# Cells assembled at a time: few enough for their matrices to stay in a core's cache, so that memory is reused.
_CELLS_IN_CACHE = 256


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
        """Return the stiffness minus a symmetric matrix (m, m) on its first unknowns, within its sparsity pattern."""
        upper = self.upper.copy()
        upper.data = upper.data - on_places(sp.triu(part, format="csr"), upper)
        return replace(self, upper=upper)


def on_places(matrix: sp.csr_matrix, places: sp.csr_matrix) -> Float:
    """Return the values (nnz,) of a matrix on the sparsity pattern of another that includes its own."""
    wide = places.shape[1]
    rows = np.repeat(np.arange(places.shape[0]), np.diff(places.indptr))
    entries = matrix.tocoo()
    positions = np.searchsorted(rows * wide + places.indices, entries.row.astype(np.int64) * wide + entries.col)
    out = np.zeros(places.nnz)
    np.add.at(out, positions, entries.data)
    return out


@dataclass(frozen=True)
class Pattern:
    """Sparsity pattern of the upper triangle and the places of the entries of cells, for repeated assemblies.

    The matrix is made of blocks: (d, d) of two nodes, (d, 1) of a node and a pressure, (1, 1) of two pressures.  A row
    of a node is one shorter than the row before it, since of the diagonal block only the upper triangle is stored.

    Attributes
    ----------
    indptr, indices : (N + 1,), (nnz,) of the csr matrix
    start : (blocks,) number of a block's first entry among the nnz
    length : (blocks,) entries in the first of the rows that the block stands in
    slot : (e, pairs) block of every local pair: of two nodes, then of a pressure and a node, then of two pressures
    swapped : (e, pairs of nodes) whether a pair's nodes stand the other way round in the matrix
    vertices : (p,) node of every pressure, see `finger3d.fem.mesh.Mesh.part_corners`
    """

    indptr: AnyInt
    indices: AnyInt
    start: Int
    length: Int
    slot: NDArray[np.int32]
    swapped: NDArray[np.bool_]
    vertices: Int

    @classmethod
    def of(cls, mesh: Mesh, mixed: bool, linked: tuple[Int, Int] | None = None) -> Pattern:
        """Find the pattern of a mesh, with pressures if `mixed`, and with places for `linked` pairs of nodes."""
        n, d = mesh.points.shape
        vertices, corner = mesh.part_corners if mixed else (np.zeros(0, dtype=np.int64), mesh.cells[:, :0])
        count = n + len(vertices)
        k = mesh.cells.shape[1]
        corners = d + 1 if mixed else 0
        (a, b), (p, r) = _pairs(k), _pairs(corners)
        pairs = len(a) + corners * k + len(p)
        size = len(mesh.cells) * pairs
        keys = np.empty(size + (len(linked[0]) if linked else 0), dtype=np.int64)
        of_cells = keys[:size].reshape(-1, pairs)
        if linked:
            keys[size:] = _key(*linked, count)
        swapped = np.empty((len(mesh.cells), len(a)), dtype=np.bool_)
        for part in cell_parts(mesh):
            cells = mesh.cells[part]
            pressures = n + corner[part]
            beside = (cells[:, None] * count + pressures[:, :, None]).reshape(len(cells), -1)
            part_keys = [_key(cells[:, a], cells[:, b], count), beside, _key(pressures[:, p], pressures[:, r], count)]
            np.concatenate(part_keys, axis=1, out=of_cells[part])
            swapped[part] = cells[:, a] > cells[:, b]
        blocks, slot = _numbered(keys)
        del keys, of_cells
        places = _places(*np.divmod(blocks, count), n, len(vertices), d)
        return cls(*places, slot[:size].reshape(-1, pairs), swapped, vertices)

    def matrix(self, data: Float) -> sp.csr_matrix:
        """The upper triangle (N, N) with the entries (nnz,), zeros kept."""
        size = len(self.indptr) - 1
        return sp.csr_matrix((data, self.indices, self.indptr), shape=(size, size))

    def add(self, data: Float, part: slice, cell: Float) -> None:
        """Add the symmetric matrices (e, k, d, k, d) of some cells' nodes to the entries (nnz,)."""
        e, k, d = cell.shape[:3]
        flat = cell.reshape(e, -1)
        a, b = _pairs(k)
        first = (a * d * k + b) * d
        swapped = self.swapped[part]
        parts = [[np.take(flat, first + (i * k * d + j), axis=1) for j in range(d)] for i in range(d)]
        slot = self.slot[part, : len(a)]
        for i, positions in enumerate(_rows(self.start[slot], self.length[slot], d)):
            for j in range(d):
                value = np.where(swapped, parts[j][i], parts[i][j])
                first_pair = 0 if j >= i else k  # the pairs of a node with itself come first
                np.add.at(data[j:], positions[:, first_pair:].ravel(), value[:, first_pair:].ravel())

    def add_pressure(self, data: Float, part: slice, coupling: Float, mass: Float) -> None:
        """Add couplings (e, p, k, d) of some cells' pressures and nodes, and symmetric (e, p, p) of their pressures."""
        _, corners, k, d = coupling.shape
        p, r = _pairs(corners)
        end = self.slot.shape[1] - len(p)
        slot = self.slot[part, end - corners * k : end]
        for i, positions in enumerate(_rows(self.start[slot], self.length[slot], d)):
            np.add.at(data, positions.ravel(), coupling[..., i].ravel())
        np.add.at(data, self.start[self.slot[part, end:]].ravel(), mass[:, p, r].ravel())


def cell_parts(mesh: Mesh) -> Iterator[slice]:
    """Yield slices of the cells, in portions of limited memory."""
    return (slice(start, start + _CELLS_IN_CACHE) for start in range(0, len(mesh.cells), _CELLS_IN_CACHE))


def _pairs(k: int) -> tuple[Int, Int]:
    """Return local pairs a <= b: the diagonal ones, then the others."""
    a, b = np.triu_indices(k, 1)
    return np.concatenate([np.arange(k), a]), np.concatenate([np.arange(k), b])


def _key(first: Int, second: Int, count: int) -> Int:
    """Return a number for each unordered pair, which sorts by the smaller node, then by the larger."""
    return np.minimum(first, second) * count + np.maximum(first, second)


def _numbered(key: Int) -> tuple[Int, NDArray[np.int32]]:
    """Return the unique keys and the index of each key among them; np.unique takes twice the memory."""
    order = np.argsort(key)
    ranked = key[order]
    new = np.zeros(len(key), dtype=np.bool_)
    np.not_equal(ranked[1:], ranked[:-1], out=new[1:])
    slot = np.empty(len(key), dtype=np.int32)
    slot[order] = np.cumsum(new, dtype=np.int32)
    new[:1] = True
    return ranked[new], slot


def _places(row: Int, col: Int, n: int, pressures: int, d: int) -> tuple[AnyInt, AnyInt, Int, Int]:
    """The attributes indptr, indices, start and length from the blocks' nodes; those from n on are pressures."""
    count = n + pressures
    before = np.concatenate([[0], np.cumsum(np.where(col < n, d, 1))])  # entries in first rows
    first = before[np.searchsorted(row, np.arange(count + 1))]
    length = np.diff(first)
    rows = np.concatenate([np.maximum(length[:n, None] - np.arange(d), 0).ravel(), length[n:]])
    indptr = np.concatenate([[0], np.cumsum(rows)])
    kind: type[np.signedinteger] = np.int32 if indptr[-1] < np.iinfo(np.int32).max else np.int64
    unknown = np.concatenate([np.arange(n) * d, np.arange(n * d, n * d + pressures)])
    start, length = (indptr[unknown] - first[:-1])[row], length[row]
    start += before[:-1]
    indices = np.empty(indptr[-1], dtype=kind)
    of_nodes, of_pressures = col < n, row >= n
    for part, tall, wide in ((of_nodes, d, d), (~of_nodes & ~of_pressures, d, 1), (of_pressures, 1, 1)):
        beside = row[part] < col[part]
        column = unknown[col[part]].astype(kind)
        for i, positions in enumerate(_rows(start[part], length[part], tall)):
            for j in range(wide):
                stored = slice(None) if j >= i else beside
                indices[(positions + j)[stored]] = (column + j)[stored]
    return indptr.astype(kind), indices, start, length


def _rows(start: Int, length: Int, count: int) -> Iterator[Int]:
    """Yield the index of the first entry of every row of the blocks, as if diagonal blocks were stored in full."""
    for _ in range(count):
        yield start
        length = length - 1
        start = start + length


def _outer_products(gradients: Float, weights: Float) -> Float:
    """Integrals (e, k, d, k, d) of G_am G_bn, from gradients G (e, q, k, d) and weights (e, q)."""
    e, q, k, d = gradients.shape
    flat = gradients.reshape(e, q, k * d)
    return np.asarray(np.matmul(np.swapaxes(flat * weights[:, :, None], 1, 2), flat).reshape(e, k, d, k, d))


def stiffness(mesh: Mesh, elastic: LinearElasticity, thickness: float = 1.0) -> Stiffness:
    """Assemble the upper triangle.

    Parameters
    ----------
    mesh : linear or quadratic mesh
    elastic : the law; the mixed form needs a quadratic mesh
    thickness : mm
        Width of a 2D section (1 for a solid), so that forces are N.
    """
    d = mesh.dim
    bary, w = quadrature(d, 2)
    pattern = Pattern.of(mesh, elastic.mixed)
    data = np.zeros(len(pattern.indices))
    hats = bary  # the linear shape functions
    scale = pressure_scale(mesh, elastic.shear) if elastic.mixed else 1.0
    for part in cell_parts(mesh):
        gradients, det = mesh.element.physical_gradients(mesh.points[mesh.cells[part]], bary)
        weights = det * (w * thickness)
        law = elastic.of_cells(part)
        pattern.add(data, part, law.contract(_outer_products(gradients, weights)))
        if elastic.mixed:
            weighted = np.swapaxes(weights[:, :, None] * hats, 1, 2)  # (e, p, q)
            e, q, k, _ = gradients.shape
            coupling = np.matmul(scale * weighted, gradients.reshape(e, q, k * d)).reshape(e, -1, k, d)
            compressibility = 1.0 / np.reshape(law.lame, (-1, 1, 1))
            mass = -(scale**2) * compressibility * np.matmul(weighted, hats)
            pattern.add_pressure(data, part, coupling, mass)
    return Stiffness(pattern.matrix(data), pattern.vertices, scale)


def pressure_scale(mesh: Mesh, shear: float) -> float:
    """Return the unit (MPa) of the pressure unknowns, so that their entries have the size of the others."""
    return float(shear * len(mesh.cells) ** (1.0 / mesh.dim) / np.ptp(mesh.points, axis=0).max())


def times(upper: sp.csr_matrix, vectors: Float) -> Float:
    """Return the product (N, ...) of a symmetric matrix, given by its upper triangle, and vectors (N, ...)."""
    return np.asarray(upper @ vectors + upper.T @ vectors - (upper.diagonal() * vectors.T).T)
