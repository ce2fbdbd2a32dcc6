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
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int
from finger3d.fem.assembly import Stiffness
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.simplex import Mesh
from finger3d.fem.solids.material import LinearElasticity

_SAMPLES_PER_COEFFICIENT = 2.5
"""Samples over coefficients below which a patch is widened by the next ring of cells: at corners of a body polynomials
of fewer samples overestimated the error of the force up to six times."""

_SINGULAR = 1e-8
"""Least eigenvalue of the normal equations of a patch, over the largest, that is not round-off."""

_CELLS_AT_ONCE, _PATCHES_AT_ONCE, _FIELDS_AT_ONCE = 512, 256, 3
"""Cells and patches whose values fit into the cache, and fields whose samples take 0.15 GB of a million unknowns."""


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
        bary, _ = quadrature(mesh.dim, 2)
        samples, coefficients = len(bary), _basis(np.zeros((1, mesh.dim))).shape[1]
        vertices, corner = mesh.part_corners
        centre = mesh.points[vertices]
        v = len(vertices)
        patches = _patches(corner, v, math.ceil(_SAMPLES_PER_COEFFICIENT * coefficients / samples))
        places = mesh.element.shape(bary) @ mesh.points[mesh.cells]
        scale, weights = np.empty(v), np.empty((coefficients, patches.nnz, samples))
        for start in range(0, v, _PATCHES_AT_ONCE):
            some = slice(start, min(start + _PATCHES_AT_ONCE, v))
            first = patches.indptr[start : some.stop + 1]
            entries = slice(first[0], first[-1])
            begins = first[:-1] - first[0]
            of = np.repeat(np.arange(len(begins)), np.diff(first))
            relative = places[patches.indices[entries]] - centre[some][of][:, None]
            scale[some] = np.maximum.reduceat(np.abs(relative).max(axis=(1, 2)), begins)
            basis = _basis(relative / scale[some][of][:, None, None])
            normal = np.add.reduceat(np.swapaxes(basis, 1, 2) @ basis, begins)
            inverse = np.linalg.pinv(normal, rcond=_SINGULAR, hermitian=True)
            weights[:, entries] = np.moveaxis(basis @ inverse[of], 2, 0)
        # of the type of the patches' indices, so that all fits share them
        columns = (patches.indices[:, None] * samples + np.arange(samples, dtype=patches.indices.dtype)).ravel()
        rows = patches.indptr * samples
        shape = (v, len(mesh.cells) * samples)
        fits = tuple(sp.csr_matrix((w.ravel(), columns, rows), shape=shape) for w in weights)
        return cls(mesh, corner, centre, scale, fits)

    def polynomials(self, samples: Float) -> Float:
        """Return the coefficients (v, n, k) of the polynomials fitted to samples (e q, k)."""
        out = np.empty((len(self.centre), len(self.fits), samples.shape[1]))
        for i, fit in enumerate(self.fits):
            out[:, i] = fit @ samples
        return out

    def evaluated(self, polynomials: Float, cells: Int, bary: Float) -> Float:
        """Return the recovered values (e', q, k) at barycentric points (q, d + 1) of cells (e',)."""
        places = self.mesh.element.shape(bary) @ self.mesh.points[self.mesh.cells[cells]]
        vertex = self.corner[cells]
        centre, scale = self.centre[vertex][:, None], self.scale[vertex][:, None, :, None]
        design = bary[:, :, None] * _basis((places[:, :, None] - centre) / scale)
        e, q, _, n = design.shape
        return np.asarray(design.reshape(e, q, -1) @ polynomials[vertex].reshape(e, -1, polynomials.shape[-1]))


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
        return np.concatenate([self._products(cells, first, second) for cells in self._portions])

    def _products(self, cells: Int, first: slice, second: slice) -> Float:
        """Return the energy products (e', a, b) in cells (e',)."""
        d = self.recovery.mesh.dim
        elastic = self.elastic
        bary, weights = quadrature(d, 5)
        pairs = _components(d)
        double = np.array([1.0 if i == j else 2.0 for i, j in pairs])
        diagonal = [k for k, (i, j) in enumerate(pairs) if i == j]
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
        a, b = (x.reshape(len(cells), -1, x.shape[-1]) for x in (a, b))
        return np.asarray(np.swapaxes(a, 1, 2) @ b)

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
        fields = self.unknowns.shape[1]
        out = np.empty((len(self.recovery.centre), len(self.recovery.fits), self._count, fields))
        for start in range(0, fields, _FIELDS_AT_ONCE):
            some = slice(start, start + _FIELDS_AT_ONCE)
            fitted = self.recovery.polynomials(replace(self, unknowns=self.unknowns[:, some])._samples)
            out[..., some] = fitted.reshape(*out[..., some].shape)
        return out.reshape(*out.shape[:2], -1)

    @property
    def _samples(self) -> Float:
        """Strain and pressure (e q, k f) at the points of the fit."""
        mesh = self.recovery.mesh
        bary, _ = quadrature(mesh.dim, 2)
        samples = np.empty((len(mesh.cells), len(bary), self._count * self.unknowns.shape[1]))
        for cells in self._portions:
            samples[cells] = self._sampled(cells, bary).reshape(len(cells), *samples.shape[1:])
        return samples.reshape(-1, samples.shape[2])

    @property
    def _count(self) -> int:
        """Number of components of strain, with the pressure of the mixed form."""
        return len(_components(self.recovery.mesh.dim)) + self.elastic.mixed

    @property
    def _portions(self) -> Iterator[Int]:
        """Numbers (e',) of cells whose fields fit into the cache."""
        count = len(self.recovery.mesh.cells)
        for start in range(0, count, _CELLS_AT_ONCE):
            yield np.arange(start, min(start + _CELLS_AT_ONCE, count))

    def _sampled(self, cells: Int, bary: Float) -> Float:
        """Return strain and pressure (e', q, k, f) at barycentric points of some cells."""
        strain, _ = self._strain(cells, bary)
        if not self.elastic.mixed:
            return strain
        return np.concatenate([strain, self._pressure(cells, bary)[:, :, None]], axis=2)

    def _strain(self, cells: Int, bary: Float) -> tuple[Float, Float]:
        """Return the components of strain (e', q, k, f) and the determinants (e', q) of cells."""
        mesh = self.recovery.mesh
        d = self.recovery.mesh.dim
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
    adjacent = sp.csr_matrix(
        (np.ones(corner.size), (corner.ravel(), np.repeat(np.arange(cells), corner.shape[1]))), (count, cells)
    )
    few = (np.diff(adjacent.indptr) < least).astype(float)
    out = sp.csr_matrix(sp.diags_array(1.0 - few) @ adjacent + sp.diags_array(few) @ adjacent @ (adjacent.T @ adjacent))
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
