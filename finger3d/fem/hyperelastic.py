"""Hyperelasticity at finite strain in the total Lagrangian form: internal forces, consistent tangent, Cauchy stress.

``W = W_iso(J^(-1/3) F) + K/2 (J - 1)^2`` with the isochoric part of a law (`finger3d.fem.laws`).  Near-incompressible
bodies take the mixed form ``W_iso + p (J - 1) - p^2 / (2 K)`` with linear p = K (J - 1).  Plane strain has F_33 = 1; in
plane stress F_33 follows from P_33 = 0 at every quadrature point and is condensed out of the tangent.

Where the stress relaxes (Simo 1987), an increment of time multiplies the two parts by factors and subtracts a second
Piola-Kirchhoff stress that follows from the state at its start, see `Relaxing`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int, freeze_arrays
from finger3d.fem.assembly import Pattern, Stiffness, cell_parts, pressure_scale
from finger3d.fem.laws import IsochoricLaw
from finger3d.fem.laws.base import Inhomogeneous
from finger3d.fem.laws.material import LEAST_COMPRESSIBILITY, MIXED_FROM, Isotropic
from finger3d.fem.mesh import Mesh, MeshPart, cells_at, quadrature
from finger3d.fem.recovery import averaged, displacement, nodal_gradient, nodal_pressure
from finger3d.fem.tensors import InvertedError, cofactor, determinant

STIFF = 1e4
"""Young's modulus, over the least of all parts, from which a part strains so little that every law has the stress
of Hooke's law.  In the round-off of F the forces of a part 1e5 times as stiff as another one are lost."""


def hookean_stress(
    slope: Float, f: Float, p: Float | None, moduli: tuple[Float, Float], past: Float, plane_stress: bool
) -> Float:
    """Return the first Piola-Kirchhoff stress (s, 3, 3) MPa of Hooke's law for the Green-Lagrange strain.

    Parameters
    ----------
    slope, f : (s, d, d), (s, 3, 3) displacement and deformation gradients
    p : (s,) MPa, the pressure of the mixed form; None in the displacement form
    moduli : shear and bulk moduli (s,) MPa
    past : (s, 3, 3) MPa, second Piola-Kirchhoff stress that has relaxed
    """
    shear, bulk = 2.0 * moduli[0], moduli[1]
    h, unit, d = np.zeros_like(f), np.eye(3), slope.shape[-1]
    h[:, :d, :d] = slope
    strain = 0.5 * (h + np.swapaxes(h, 1, 2) + np.swapaxes(h, 1, 2) @ h)
    dilatation = np.trace(strain, axis1=1, axis2=2)
    if plane_stress:
        across = (past[:, 2, 2] + (shear / 3.0 - bulk) * dilatation) / (2.0 / 3.0 * shear + bulk)
        strain[:, 2, 2], dilatation = across, dilatation + across
    second = shear[:, None, None] * (strain - dilatation[:, None, None] / 3.0 * unit) - past
    if p is None:
        return np.asarray(f @ (second + (bulk * dilatation)[:, None, None] * unit))
    return np.asarray(f @ second + p[:, None, None] * cofactor(f))


_THICKNESS_ITERATIONS, _THICKNESS_ERROR = 60, 1e-9
"""Iterations for the stretch of the thickness at most, and relative change of it in the last: the next change would be
its square."""


@dataclass(frozen=True)
class Relaxing:
    """Relaxation of the stress over one increment of time: ``a_iso S_iso + a_vol S_vol - S_past``.

    Attributes
    ----------
    isochoric, volumetric : factors a of the elastic stress
    past : (m, 3, 3) MPa, second Piola-Kirchhoff stress at the quadrature points
    """

    isochoric: float
    volumetric: float
    past: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def of_points(self, points: slice) -> Relaxing:
        """Return the relaxation at some quadrature points."""
        return Relaxing(self.isochoric, self.volumetric, self.past[points])


@dataclass(frozen=True)
class Hyperelastic:
    """A hyperelastic material: isochoric law, bulk modulus (MPa), and which form is used.

    In an inhomogeneous body law and bulk modulus (m,) belong to m points, at which the material is evaluated; `stiff`
    (s,) are the numbers of those in parts far stiffer than others.
    """

    law: IsochoricLaw
    bulk: float | Float
    mixed: bool
    plane_stress: bool = False
    stiff: Int | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @classmethod
    def of(cls, law: IsochoricLaw, nu: float, plane_stress: bool = False) -> Hyperelastic:
        """Return the material with a Poisson's ratio in the limit of small strain."""
        return cls(law, _bulk_modulus(law.shear, nu), nu >= MIXED_FROM and not plane_stress, plane_stress)

    @classmethod
    def of_parts(
        cls, law: IsochoricLaw, materials: Sequence[Isotropic], part: Int, plane_stress: bool = False
    ) -> Hyperelastic:
        """Return the material of a body of several parts.

        Parameters
        ----------
        law : of all parts, but for its shear modulus
        materials : limit of small strain of each part, by its number
        part : (m,) number of the part at each point
        """
        shear = np.array([material.E_MPa / (2.0 * (1.0 + material.nu)) for material in materials])
        bulk = np.array([_bulk_modulus(g, m.nu) for g, m in zip(shear, materials, strict=True)])
        mixed = any(material.is_nearly_incompressible for material in materials)
        everywhere = Inhomogeneous(law.with_shear(float(shear[0])), (shear / shear[0])[part])
        young = np.array([material.E_MPa for material in materials])
        stiff = np.flatnonzero((young >= STIFF * young.min())[part])
        return cls(everywhere, bulk[part], mixed and not plane_stress, plane_stress, stiff if len(stiff) else None)

    def of_points(self, points: slice) -> Hyperelastic:
        """Return the material at some of the points of a body, without stiff ones; itself if it is homogeneous."""
        if not isinstance(self.law, Inhomogeneous):
            return self
        return replace(self, law=self.law.of_points(points), bulk=np.asarray(self.bulk)[points], stiff=None)

    def deformation(self, slope: Float, relaxing: Relaxing | None = None) -> Float:
        """Return F (..., 3, 3) from displacement gradients (..., d, d), row the component.

        Raises
        ------
        InvertedError
            If a determinant is not positive, or in plane stress no thickness is free of stress.
        """
        d = slope.shape[-1]
        f = np.moveaxis(np.zeros((3, 3, *slope.shape[:-2])), (0, 1), (-2, -1))  # each component without gaps: quicker
        f[..., :, :] = np.eye(3)
        f[..., :d, :d] += slope
        if not (determinant(f) > 0.0).all():
            raise InvertedError
        return self._with_thickness(f, relaxing) if self.plane_stress else f

    def _with_thickness(self, f: Float, relaxing: Relaxing | None) -> Float:
        """F (..., 3, 3) with F_33 such that P_33 = 0 (plane stress), by Newton from the isochoric value.

        Solves ``area F_33 - 1 = - P_33 / (K area)`` with P_33 of all but the volumetric part; the area is the
        determinant in the plane.  Well conditioned for any K.  Steps out of the interval that holds the root halve it.
        """
        f = f.copy()
        a_iso, a_vol, past = _factors(relaxing)
        first, second = _plane_stretches(f)
        area = first * second
        f[..., 2, 2] = 1.0 / area
        low, high = np.zeros_like(area), np.full_like(area, np.inf)
        for _ in range(_THICKNESS_ITERATIONS):
            stretch = f[..., 2, 2]
            stress, tangent = self._stress_across(first, second, stretch)
            scale = 1.0 / (a_vol * self.bulk * area)
            excess = a_iso * stress - stretch * past[..., 2, 2]
            slope = area + scale * (a_iso * tangent - past[..., 2, 2])
            short = 1.0 - area * stretch - scale * excess
            low, high = np.where(short > 0.0, stretch, low), np.where(short < 0.0, stretch, high)
            step = short / slope
            settled = (np.abs(step) < _THICKNESS_ERROR * stretch) & (slope > 0.0)  # round-off may leave the interval
            outside = (stretch + step <= low) | (stretch + step >= high) | (slope <= 0.0)
            halved = np.where(np.isinf(high), 2.0 * stretch, 0.5 * (low + high)) - stretch
            f[..., 2, 2] = stretch + np.where(outside & ~settled, halved, step)
            if settled.all():
                return f
        raise InvertedError

    def _stress_across(self, first: Float, second: Float, across: Float) -> tuple[Float, Float]:
        """Return P_33 (...,) MPa of the isochoric part, and its derivative by F_33, from the principal stretches."""
        stretches = np.stack([first, second, across], axis=-1)
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite never converges
            kirchhoff, by_logs = self.law.principal_stress(stretches / np.cbrt(first * second * across)[..., None])
            rates = by_logs[..., 2] - by_logs.mean(axis=-1)  # at constant volume
            stress = (kirchhoff[..., 2] - kirchhoff.mean(axis=-1)) / across
            return stress, (rates[..., 2] - rates.mean(axis=-1)) / across**2 - stress / across

    def _spherical(self, f: Float, cof: Float, isochoric: Float, p: Float | None, relaxing: Relaxing | None) -> Float:
        """Return the factor (...,) of cof F in the stress, MPa.

        In plane stress it follows from P_33 = 0, which unlike K (J - 1) loses no digits where K is large.
        """
        a_iso, a_vol, past = _factors(relaxing)
        if self.plane_stress:
            return np.asarray(
                (f[..., 2, 2] * past[..., 2, 2] - a_iso * isochoric[..., 2, 2]) / cof[..., 2, 2], dtype=np.float64
            )
        return np.asarray(a_vol * (self.bulk * (determinant(f) - 1.0) if p is None else p))

    def stress(self, f: Float, p: Float | None, relaxing: Relaxing | None = None, slope: Float | None = None) -> Float:
        """Return the first Piola-Kirchhoff stress (..., 3, 3) MPa.

        Parameters
        ----------
        f : (..., 3, 3) from `deformation`
        p : (...,) MPa, the pressure of the mixed form; None in the displacement form
        slope : (..., d, d), the displacement gradients of f, without the round-off of f at stiff points
        """
        isochoric, cof = self.law.stress(f), cofactor(f)
        spherical = self._spherical(f, cof, isochoric, p, relaxing)[..., None, None]
        stress = np.asarray((1.0 if relaxing is None else relaxing.isochoric) * isochoric + spherical * cof)
        if relaxing is not None:
            stress -= f @ relaxing.past
        if self.stiff is not None and slope is not None:
            stress[self.stiff] = self._stress_at_stiff_points(slope, f, p, relaxing)
        return stress

    def _stress_at_stiff_points(self, slope: Float, f: Float, p: Float | None, relaxing: Relaxing | None) -> Float:
        points, law = self.stiff, self.law
        a_iso, a_vol, past = _factors(relaxing)
        relative = law.relative if isinstance(law, Inhomogeneous) else np.ones(len(f))
        moduli = a_iso * law.shear * relative[points], a_vol * np.asarray(self.bulk)[points]
        past, pressure = np.broadcast_to(past, f.shape)[points], None if p is None else a_vol * p[points]
        return hookean_stress(slope[points], f[points], pressure, moduli, past, self.plane_stress)

    def stress_and_tangent(self, f: Float, p: Float | None, relaxing: Relaxing | None = None) -> tuple[Float, Float]:
        """Return the first Piola-Kirchhoff stress (..., 3, 3) and its derivative (..., 3, 3, 3, 3) by F, MPa."""
        a_iso, a_vol, past = _factors(relaxing)
        isochoric, tangent = self.law.stress_and_tangent(f)
        cof, j = cofactor(f), determinant(f)
        spherical = self._spherical(f, cof, isochoric, p, relaxing)
        rate = spherical / j  # d cof_iJ / d F_kL = (cof_iJ cof_kL - cof_iL cof_kJ) / J
        both = cof[..., :, :, None, None] * cof[..., None, None, :, :]
        along = rate + (a_vol * self.bulk if p is None else 0.0)
        tangent = a_iso * tangent + along[..., None, None, None, None] * both
        tangent -= rate[..., None, None, None, None] * np.swapaxes(both, -1, -3)
        stress = a_iso * isochoric + spherical[..., None, None] * cof
        if relaxing is not None:
            stress = stress - f @ past
            for i in range(3):
                tangent[..., i, :, i, :] -= past
        return stress, tangent

    def in_plane(self, tangent: Float) -> Float:
        """Return the tangent of plane stress, P_33 = 0 condensed out."""
        column, row = tangent[..., :, :, 2, 2], tangent[..., 2, 2, :, :]
        pivot = tangent[..., 2, 2, 2, 2][..., None, None, None, None]
        return np.asarray(tangent - column[..., :, :, None, None] * row[..., None, None, :, :] / pivot)

    def elastic_stress(self, f: Float, p: Float | None, relaxing: Relaxing | None, volumetric: bool) -> Float:
        """Return the elastic second Piola-Kirchhoff stress (..., 3, 3) MPa, of the isochoric part or of the whole."""
        isochoric, cof = self.law.stress(f), cofactor(f)
        first = isochoric
        if volumetric:
            a_vol = _factors(relaxing)[1]
            first = first + (self._spherical(f, cof, isochoric, p, relaxing) / a_vol)[..., None, None] * cof
        return np.asarray(np.swapaxes(cof, -1, -2) @ first / determinant(f)[..., None, None])


def _plane_stretches(f: Float) -> tuple[Float, Float]:
    """Return the principal stretches (...,) in the plane, the larger first."""
    even = np.hypot(f[..., 0, 0] + f[..., 1, 1], f[..., 0, 1] - f[..., 1, 0])
    odd = np.hypot(f[..., 0, 0] - f[..., 1, 1], f[..., 0, 1] + f[..., 1, 0])
    larger = 0.5 * (even + odd)
    return larger, (f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]) / larger


def _bulk_modulus(shear: float, nu: float) -> float:
    return shear / max(1.5 * (1.0 - 2.0 * nu) / (1.0 + nu), LEAST_COMPRESSIBILITY)


def _factors(relaxing: Relaxing | None) -> tuple[float, float, Float]:
    return (
        (1.0, 1.0, np.zeros((3, 3))) if relaxing is None else (relaxing.isochoric, relaxing.volumetric, relaxing.past)
    )


@dataclass(frozen=True)
class TotalLagrangian:
    """Discretisation of a hyperelastic body by quadratic simplices, with linear pressures in the mixed form.

    Unknowns x (N,): displacements ``node * d + axis`` in mm, then scaled pressures at the vertices.

    Attributes
    ----------
    thickness : mm, the width of a section, 1 for a solid
    pattern : of the tangent; mixed as the material is
    """

    mesh: Mesh
    material: Hyperelastic
    thickness: float
    pattern: Pattern

    @cached_property
    def _operators(self) -> tuple[sp.csr_matrix, Float, sp.csr_matrix | None]:
        """Gradient (e q d, n) of nodal fields, weights (e, q), and values (e q, v) of fields linear in every cell."""
        mesh, d = self.mesh, self.mesh.dim
        bary, w = quadrature(d, 2)
        cells = mesh.cells
        q = len(bary)
        e, k = cells.shape
        data, weights = np.empty((e, q, d, k)), np.empty((e, q))
        for part in cell_parts(mesh):
            gradients, det = mesh.element.physical_gradients(mesh.points[cells[part]], bary)
            data[part] = np.swapaxes(gradients, 2, 3)
            weights[part] = det * (w * self.thickness)
        indices = np.broadcast_to(cells[:, None, None, :], data.shape).ravel()
        rows = e * q * d
        n = len(mesh.points)
        gradient = sp.csr_matrix((data.ravel(), indices, np.arange(rows + 1) * k), shape=(rows, n))
        if not self.material.mixed:
            return gradient, weights, None
        values = np.broadcast_to(bary, (e, q, d + 1)).ravel()
        vertices, corner = mesh.part_corners
        corners = np.broadcast_to(corner[:, None], (e, q, d + 1)).ravel()
        hats = sp.csr_matrix((values, corners, np.arange(e * q + 1) * (d + 1)), shape=(e * q, len(vertices)))
        return gradient, weights, hats

    @cached_property
    def pressure_scale(self) -> float:
        """Unit of the pressure unknowns, MPa."""
        return pressure_scale(self.mesh, self.material.law.shear)

    def slopes(self, x: Float) -> Float:
        """Return the displacement gradients (m, d, d) at the quadrature points, row the component."""
        d = self.mesh.dim
        slopes = self._operators[0] @ displacement(self.mesh, x)
        return np.swapaxes(slopes.reshape(-1, d, d), 1, 2)

    def pressures(self, x: Float) -> Float | None:
        """Return the pressure (m,) MPa at the quadrature points in the mixed form."""
        hats = self._operators[2]
        if hats is None:
            return None
        return np.asarray(hats @ (self.pressure_scale * x[self.mesh.points.size :]))

    def deformation(self, x: Float, relaxing: Relaxing | None = None) -> Float:
        """Return the deformation gradients (m, 3, 3) at the quadrature points; raises InvertedError."""
        return self.material.deformation(self.slopes(x), relaxing)

    def internal_forces(self, x: Float, relaxing: Relaxing | None = None) -> Float:
        """Return the internal forces (N,), in the mixed form with the residual of p = K (J - 1).

        Raises
        ------
        InvertedError
            If a cell is inverted.
        """
        d = self.mesh.dim
        p = self.pressures(x)
        gradient, weights, hats = self._operators
        slopes = self.slopes(x)
        f = self.material.deformation(slopes, relaxing)
        stress = self.material.stress(f, p, relaxing, slopes)[:, :d, :d] * weights.reshape(-1, 1, 1)
        force = gradient.T @ np.ascontiguousarray(np.swapaxes(stress, 1, 2)).reshape(-1, d)
        if hats is None or p is None:
            return np.asarray(force.ravel())
        excess = (determinant(f) - 1.0 - p / self.material.bulk) * weights.ravel()
        volumetric = 1.0 if relaxing is None else relaxing.volumetric
        volume = volumetric * self.pressure_scale * (hats.T @ excess)
        return np.concatenate([force.ravel(), volume])

    def tangent(self, x: Float, relaxing: Relaxing | None = None) -> Stiffness:
        """Return the tangent stiffness, the derivative of the internal forces; may raise InvertedError."""
        mesh, d = self.mesh, self.mesh.dim
        p = self.pressures(x)
        gradient, weights, _ = self._operators
        e, q = weights.shape
        gradients = gradient.data.reshape(e, q, d, -1)
        slopes = self.slopes(x).reshape(e, q, d, d)
        hats, _ = quadrature(d, 2)
        data = np.zeros(len(self.pattern.indices))
        volumetric = 1.0 if relaxing is None else relaxing.volumetric
        scale = volumetric * self.pressure_scale
        mass = -scale * self.pressure_scale * np.einsum("qp,qr->qpr", hats, hats)
        for part in cell_parts(mesh):
            points = slice(part.start * q, part.stop * q)
            local_relaxing = relaxing.of_points(points) if relaxing else None
            local, w = gradients[part], weights[part]
            material = self.material.of_points(points)
            f = material.deformation(slopes[part].reshape(-1, d, d), local_relaxing)
            _, tangent = material.stress_and_tangent(f, None if p is None else p[points], local_relaxing)
            if material.plane_stress:
                tangent = material.in_plane(tangent)
            k = local.shape[3]
            weighted = (tangent[:, :d, :d, :d, :d] * w.reshape(-1, 1, 1, 1, 1)).reshape(-1, q, d * d * d, d)
            right = np.matmul(weighted, local).reshape(-1, q, d, d, d, k)  # i J k b
            right = np.ascontiguousarray(right.transpose(0, 1, 3, 2, 4, 5)).reshape(-1, q * d, d * d * k)
            left = np.ascontiguousarray(local.transpose(0, 3, 1, 2)).reshape(-1, k, q * d)
            self.pattern.add(data, part, np.matmul(left, right).reshape(-1, k, d, d, k).transpose(0, 1, 2, 4, 3))
            if p is not None:
                flux = np.matmul(cofactor(f)[:, :d, :d].reshape(-1, q, d, d), local)  # (e, q, i, a)
                flux = np.swapaxes(flux * (scale * w)[:, :, None, None], 2, 3).reshape(len(w), q, k * d)
                coupling = np.matmul(hats.T, flux).reshape(-1, d + 1, k, d)
                compliance = w / np.broadcast_to(material.bulk, w.size).reshape(w.shape)
                self.pattern.add_pressure(data, part, coupling, np.tensordot(compliance, mass, axes=1))
        return Stiffness(self.pattern.matrix(data), self.pattern.vertices, self.pressure_scale)

    def elastic_stress(self, x: Float, relaxing: Relaxing | None, volumetric: bool) -> Float:
        """Return the elastic second Piola-Kirchhoff stress (m, 3, 3) MPa at the quadrature points."""
        return self.material.elastic_stress(self.deformation(x, relaxing), self.pressures(x), relaxing, volumetric)


def stretch(mesh: Mesh, u: Float, point: Float, direction: Float) -> float:
    """Relative elongation |F d| - 1 at `point` (d,) along the unit `direction` (d,), mean over cells that hold it."""
    elongations = []
    for cell, bary in cells_at(mesh, point):
        nodes = mesh.cells[cell]
        slope = u[nodes].T @ mesh.element.physical_gradients(mesh.points[nodes][None], bary[None])[0][0, 0]
        elongations.append(np.linalg.norm(direction + slope @ direction) - 1.0)
    return float(np.mean(elongations))


def nodal_fields(body: TotalLagrangian, x: Float) -> tuple[Float, Float, Float]:
    """Return deformation gradient, Green-Lagrange strain and elastic Cauchy stress (n, 3, 3) at the nodes.

    They follow from the volume-weighted mean of the displacement gradient at every node.  At a node where it is folded
    over they are those of a quadrature point beside it.
    """
    points = len(quadrature(body.mesh.dim, 2)[0])
    u = displacement(body.mesh, x)
    vertex_pressure = body.pressure_scale * x[body.mesh.points.size :]

    def of_part(part: MeshPart) -> tuple[Float, Float]:
        first = part.cells[0] * points  # one point stands for all of a part
        material = body.material.of_points(slice(first, first + 1))
        f = material.deformation(_sound_gradient(part.mesh, u[part.nodes]))
        p = nodal_pressure(part.mesh, vertex_pressure[part.corners]) if material.mixed else None
        return f, material.stress(f, p) @ np.swapaxes(f, 1, 2) / determinant(f)[:, None, None]

    f, cauchy = averaged(body.mesh, of_part)
    return f, 0.5 * (np.swapaxes(f, 1, 2) @ f - np.eye(3)), cauchy


def _sound_gradient(mesh: Mesh, u: Float) -> Float:
    """Displacement gradient (n, d, d) at the nodes, where it is folded over that of a quadrature point beside it."""
    slope = nodal_gradient(mesh, u)
    folded = np.linalg.det(slope + np.eye(mesh.dim)) <= 0.0
    if folded.any():
        bary, _ = quadrature(mesh.dim, 2)
        nearest = (mesh.element.nodes @ bary.T).argmax(axis=1)
        cells, local = np.nonzero(folded[mesh.cells])
        for q in np.unique(nearest[local]):
            one, nodes = cells[nearest[local] == q], local[nearest[local] == q]
            gradients, _ = mesh.element.physical_gradients(mesh.points[mesh.cells[one]], bary[q : q + 1])
            slope[mesh.cells[one, nodes]] = np.einsum("eki,ekj->eij", u[mesh.cells[one]], gradients[:, 0])
    return slope
