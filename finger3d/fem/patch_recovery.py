"""Recovered strain and pressure of a displacement field, and the errors that they estimate.

Superconvergent patch recovery (Zienkiewicz and Zhu 1992): around every vertex a polynomial of degree 2 is fitted to the
strains at the quadrature points of the adjacent cells, where they are most accurate; at an interface every part has a
polynomial of its own.  In a cell the recovered strain is the mean of the polynomials of its vertices, weighted with the
barycentric coordinates.  It is more accurate than the strain itself, so that their difference estimates the error of
the strain, cell by cell and with its sign.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int
from finger3d.fem.assembly import Stiffness
from finger3d.fem.elements import quadrature
from finger3d.fem.material import LinearElasticity
from finger3d.fem.simplex import Mesh

_SAMPLES_PER_COEFFICIENT = 2.5
"""Samples over coefficients below which a patch is widened by the next ring of cells: at corners of a body polynomials
of fewer samples overestimated the error of the force up to six times."""

_SINGULAR = 1e-8
"""Least eigenvalue of the normal equations of a patch, over the largest, that is not round-off."""

_CELLS_AT_ONCE = 512


@dataclass(frozen=True)
class PatchRecovery:
    """Least-squares polynomials around the vertices of a mesh (v vertices, e cells of q samples).

    Attributes
    ----------
    mesh : Mesh
    corner : (e, d + 1) numbers of the cells' vertices among the v vertices
    centre : (v, d) mm, and scale : (v,) mm
        The polynomials are in (x - centre) / scale.
    fits : sparse matrices (v, e q), one for each coefficient of the polynomials
    """

    mesh: Mesh
    corner: Int
    centre: Float
    scale: Float
    fits: tuple[sp.csr_matrix, ...]

    @classmethod
    def of(cls, mesh: Mesh) -> PatchRecovery:
        """Return the polynomial fits of a mesh."""
        d, count = mesh.dim, len(mesh.cells)
        bary, _ = quadrature(d, 2)
        samples = len(bary)
        vertices, corner = mesh.part_corners
        centre, v = mesh.points[vertices], len(vertices)
        patches = _patches(corner, v, math.ceil(_SAMPLES_PER_COEFFICIENT * _basis(np.zeros((1, d))).shape[1] / samples))
        of, cell = np.repeat(np.arange(v), np.diff(patches.indptr)), patches.indices
        places = mesh.element.shape(bary) @ mesh.points[mesh.cells]
        relative = places[cell] - centre[of][:, None]
        scale = np.zeros(v)
        np.maximum.at(scale, of, np.abs(relative).max(axis=(1, 2)))
        basis = _basis(relative / scale[of][:, None, None])
        normal = np.zeros((v, basis.shape[2], basis.shape[2]))
        np.add.at(normal, of, np.einsum("pqi,pqj->pij", basis, basis))
        inverse = np.linalg.pinv(normal, rcond=_SINGULAR, hermitian=True)
        weights = np.einsum("pij,pqj->ipq", inverse[of], basis)
        columns = (cell[:, None] * samples + np.arange(samples)).ravel()
        shape = (v, count * samples)
        fits = tuple(sp.csr_matrix((w.ravel(), columns, patches.indptr * samples), shape=shape) for w in weights)
        return cls(mesh, corner, centre, scale, fits)

    def polynomials(self, samples: Float) -> Float:
        """Return the coefficients (v, n, k) of the polynomials fitted to samples (e q, k)."""
        return np.stack([fit @ samples for fit in self.fits], axis=1)

    def evaluated(self, polynomials: Float, cells: Int, bary: Float) -> Float:
        """Return the recovered values (e', q, k) at barycentric points (q, d + 1) of cells (e',)."""
        places = self.mesh.element.shape(bary) @ self.mesh.points[self.mesh.cells[cells]]
        total: Float = np.zeros(1)
        for vertex, weight in zip(self.corner[cells].T, bary.T, strict=True):
            relative = (places - self.centre[vertex][:, None]) / self.scale[vertex][:, None, None]
            total = total + (weight[:, None] * _basis(relative)) @ polynomials[vertex]
        return total


@dataclass(frozen=True)
class RecoveredErrors:
    """Errors of several fields of a body, estimated by recovery.

    Attributes
    ----------
    thickness : mm, the width of a section, 1 for a solid
    unknowns : (N, f), one field a column
    """

    recovery: PatchRecovery
    elastic: LinearElasticity
    stiffness: Stiffness
    thickness: float
    unknowns: Float

    def products(self, first: slice, second: slice) -> Float:
        """Return the energy products (e, a, b), mJ, of the errors of two groups of fields in every cell.

        In the displacement form this is the integral of ``sigma(e_a) : eps(e_b)``.  The mixed form has
        ``sigma(e_a) = C : eps(e_a) + p(e_a) I``, and ``p(e_b) (p_a / lam - div u_a)`` beside it.
        """
        found = [np.swapaxes(a, 1, 2) @ b for a, b in self._factors(first, second)]
        return np.concatenate(found)

    def _factors(self, first: slice, second: slice) -> Iterator[tuple[Float, Float]]:
        """Yield arrays (e', n, a) and (e', n, b) of some cells; the products are sums over n."""
        mesh, d, elastic = self.recovery.mesh, self.recovery.mesh.dim, self.elastic
        bary, weights = quadrature(d, 5)
        pairs = _components(d)
        double = np.array([1.0 if i == j else 2.0 for i, j in pairs])
        diagonal = [k for k, (i, j) in enumerate(pairs) if i == j]
        for start in range(0, len(mesh.cells), _CELLS_AT_ONCE):
            cells = np.arange(start, min(start + _CELLS_AT_ONCE, len(mesh.cells)))
            strain, determinant = self._strain(cells, bary)
            recovered = self.recovery.evaluated(self._polynomials, cells, bary)
            recovered = recovered.reshape(*recovered.shape[:2], -1, strain.shape[-1])
            error = recovered[:, :, : len(pairs)] - strain
            left, right = error[..., first], error[..., second]
            law = elastic.of_cells(cells)
            stress = _components_of(law.stress(_tensors(left, d)), left.shape)
            one, two = [stress * double[:, None]], [right]
            if elastic.mixed:
                pressure = self._pressure(cells, bary)[:, :, None]
                off = recovered[:, :, -1:] - pressure
                residual = pressure[..., first] / np.reshape(law.pressure_modulus, (-1, 1, 1, 1))
                residual = residual - strain[:, :, diagonal, first].sum(axis=2, keepdims=True)
                one += [off[..., first], residual]
                two += [right[:, :, diagonal].sum(axis=2, keepdims=True), off[..., second]]
            volume = (determinant * weights * self.thickness)[:, :, None, None]
            a, b = np.concatenate(one, axis=2) * volume, np.concatenate(two, axis=2)
            yield a.reshape(len(cells), -1, a.shape[-1]), b.reshape(len(cells), -1, b.shape[-1])

    def strain_along(self, field: Float, direction: Float, cells: Int, bary: Float) -> Float:
        """Return the error (e', q) of the normal strain along a direction (d,) of the sum of the fields times (f,)."""
        pairs = _components(self.recovery.mesh.dim)
        along = np.array([direction[i] * direction[j] * (1.0 if i == j else 2.0) for i, j in pairs])
        recovered = self.recovery.evaluated(self._polynomials, cells, bary)
        recovered = recovered.reshape(*recovered.shape[:2], -1, len(field))[:, :, : len(pairs)]
        return np.asarray(along @ ((recovered - self._strain(cells, bary)[0]) @ field)[..., None])[..., 0]

    @cached_property
    def _polynomials(self) -> Float:
        """Coefficients (v, n, k f): of the components of strain, then of the pressure of the mixed form."""
        bary, _ = quadrature(self.recovery.mesh.dim, 2)
        samples = [self._sampled(slice(s, s + _CELLS_AT_ONCE), bary) for s in self._starts]
        values = np.concatenate(samples)
        return self.recovery.polynomials(values.reshape(values.shape[0] * values.shape[1], -1))

    @property
    def _starts(self) -> range:
        return range(0, len(self.recovery.mesh.cells), _CELLS_AT_ONCE)

    def _sampled(self, part: slice, bary: Float) -> Float:
        """Return strain and pressure (e', q, k, f) at barycentric points of some cells."""
        cells = np.arange(len(self.recovery.mesh.cells))[part]
        strain, _ = self._strain(cells, bary)
        if not self.elastic.mixed:
            return strain
        return np.concatenate([strain, self._pressure(cells, bary)[:, :, None]], axis=2)

    def _strain(self, cells: Int, bary: Float) -> tuple[Float, Float]:
        """Return the components of strain (e', q, k, f) and the determinants (e', q) of cells."""
        mesh, d = self.recovery.mesh, self.recovery.mesh.dim
        nodes = mesh.cells[cells]
        gradients, determinant = mesh.element.physical_gradients(mesh.points[nodes], bary)
        u = self.unknowns[: mesh.points.size].reshape(len(mesh.points), d, -1)[nodes]
        e, q, k, _ = gradients.shape
        slope = np.swapaxes(gradients, 2, 3).reshape(e, q * d, k) @ u.reshape(e, k, -1)
        slope = slope.reshape(e, q, d, d, -1)  # derivative, component
        return np.stack([0.5 * (slope[:, :, i, j] + slope[:, :, j, i]) for i, j in _components(d)], axis=2), determinant

    def _pressure(self, cells: Int, bary: Float) -> Float:
        """Return the pressures (e', q, f), MPa, of the mixed form."""
        mesh = self.recovery.mesh
        at_vertices = self.stiffness.pressure_scale * self.unknowns[mesh.points.size :]
        return np.asarray(bary @ at_vertices[self.recovery.corner[cells]])


def _patches(corner: Int, count: int, least: int) -> sp.csr_matrix:
    """Return which cells (v, e) are fitted around each vertex, at least so many where the mesh has them."""
    cells = len(corner)
    at = sp.csr_matrix(
        (np.ones(corner.size), (corner.ravel(), np.repeat(np.arange(cells), corner.shape[1]))), (count, cells)
    )
    few = (np.diff(at.indptr) < least).astype(float)
    out = sp.csr_matrix(sp.diags_array(1.0 - few) @ at + sp.diags_array(few) @ at @ (at.T @ at))
    out.eliminate_zeros()
    out.sort_indices()
    return out


def _basis(x: Float) -> Float:
    """Return the monomials (..., n) up to degree 2 of coordinates (..., d)."""
    d = x.shape[-1]
    square = [x[..., i] * x[..., j] for i in range(d) for j in range(i, d)]
    return np.stack([np.ones(x.shape[:-1]), *np.moveaxis(x, -1, 0), *square], axis=-1)


def _components(d: int) -> list[tuple[int, int]]:
    """Return the index pairs of the independent components of a symmetric tensor."""
    return [(i, j) for i in range(d) for j in range(i, d)]


def _tensors(components: Float, d: int) -> Float:
    """Return symmetric tensors (n, d, d) from components (e, q, k, a)."""
    out = np.empty((*components.shape[:2], components.shape[3], d, d))
    for k, (i, j) in enumerate(_components(d)):
        out[..., i, j] = out[..., j, i] = components[:, :, k]
    return out.reshape(-1, d, d)


def _components_of(tensors: Float, shape: tuple[int, ...]) -> Float:
    """Return the components (e, q, k, a) of symmetric tensors (n, d, d)."""
    d = tensors.shape[-1]
    whole = tensors.reshape(shape[0], shape[1], shape[3], d, d)
    return np.stack([whole[..., i, j] for i, j in _components(d)], axis=2)
