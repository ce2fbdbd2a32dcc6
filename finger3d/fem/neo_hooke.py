"""Neo-Hookean elasticity at finite strain: internal forces, consistent tangent, Cauchy stress.

``W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2``, isochoric split (Bonet and Wood 2008, sec. 6.5).  Near-incompressible
bodies take the mixed form ``W_iso + p (J - 1) - p^2 / (2 K)`` with linear p = K (J - 1).  Plane strain has F_33 = 1; in
plane stress F_33 follows from P_33 = 0 at every quadrature point and is condensed out of the tangent.  The mean stress
is then ``p J = G J^(-2/3) (I1/3 - F_33^2)``, which unlike K (J - 1) loses no digits where K is large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.fem.assembly import Pattern, Stiffness, cell_parts, pressure_scale
from finger3d.fem.elements import quadrature
from finger3d.fem.locate import cells_at
from finger3d.fem.material import LEAST_COMPRESSIBILITY, MIXED_FROM
from finger3d.fem.recover import displacement, nodal_gradient, nodal_pressure
from finger3d.fem.simplex import Mesh

_THICKNESS_ITERATIONS = 30


class InvertedError(ArithmeticError):
    """A cell was inverted: the increment is too large for the mesh."""


@dataclass(frozen=True)
class NeoHooke:
    """Constants (MPa), and which form is used."""

    shear: float
    bulk: float
    mixed: bool
    plane_stress: bool = False

    @classmethod
    def of(cls, E_MPa: float, nu: float, plane_stress: bool = False) -> NeoHooke:
        """Return the law with this Young's modulus and Poisson's ratio in the limit of small strain."""
        shear = E_MPa / (2.0 * (1.0 + nu))
        compressibility = max(3.0 * (1.0 - 2.0 * nu) / E_MPa, LEAST_COMPRESSIBILITY / shear)
        return cls(shear, 1.0 / compressibility, nu >= MIXED_FROM and not plane_stress, plane_stress)


def first_piola_and_tangent(law: NeoHooke, f: Float, p: Float | None) -> tuple[Float, Float]:
    """First Piola stress (..., 3, 3) and its derivative (..., 3, 3, 3, 3) by F; `p` (...,) MPa in the mixed form.

    In plane stress F is one of `deformation`, for which P_33 = 0.
    """
    j = np.linalg.det(f)
    inverse = np.linalg.inv(f)  # [J, i]
    turned = np.swapaxes(inverse, -1, -2)  # F^-T [i, J]
    i1 = np.einsum("...iJ,...iJ->...", f, f)
    g = law.shear * j ** (-2.0 / 3.0)
    if law.plane_stress:
        spherical = g * (i1 / 3.0 - f[..., 2, 2] ** 2) / j
    else:
        spherical = law.bulk * (j - 1.0) if p is None else p
    stress = g[..., None, None] * (f - i1[..., None, None] / 3.0 * turned) + (spherical * j)[..., None, None] * turned
    both = np.einsum("...iJ,...kL->...iJkL", turned, turned)
    cross = np.einsum("...Jk,...Li->...iJkL", inverse, inverse)
    mixed = np.einsum("...iJ,...kL->...iJkL", f, turned)
    mixed = mixed + np.moveaxis(mixed, (-4, -3, -2, -1), (-2, -1, -4, -3))
    identity = np.einsum("ik,JL->iJkL", np.eye(3), np.eye(3))
    volumetric = spherical * j + (law.bulk * j**2 if p is None else 0.0)

    def wide(scalar: Float) -> Float:
        return np.asarray(scalar)[..., None, None, None, None]

    tangent = wide(g) * (identity - 2.0 / 3.0 * mixed) + wide(2.0 / 9.0 * g * i1 + volumetric) * both
    return stress, tangent + wide(g * i1 / 3.0 - spherical * j) * cross


def _thickness(law: NeoHooke, f: Float) -> Float:
    """F (..., 3, 3) with F_33 such that P_33 = 0 (plane stress), by Newton from the isochoric value.

    Solves ``area F_33 - 1 = p(F_33) / K``, where the area is the determinant in the plane; well conditioned for any K.
    Raises InvertedError where the area is not positive.
    """
    f = f.copy()
    area = f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]
    if not (area > 0.0).all():
        raise InvertedError
    plane = (f[..., :2, :2] ** 2).sum(axis=(-2, -1))
    stretch = 1.0 / area
    for _ in range(_THICKNESS_ITERATIONS):
        factor = law.shear / (3.0 * law.bulk) * (area * stretch) ** (-5.0 / 3.0)
        excess = plane - 2.0 * stretch**2
        slope = area + factor * (5.0 / 3.0 * excess / stretch + 4.0 * stretch)
        step = (factor * excess + 1.0 - area * stretch) / slope
        stretch = stretch + np.maximum(step, -0.5 * stretch)
        if np.abs(step).max() < 1e-14:
            break
    f[..., 2, 2] = stretch
    return f


def deformation(law: NeoHooke, slope: Float) -> Float:
    """F (..., 3, 3) from displacement gradients (..., d, d), row the component."""
    d = slope.shape[-1]
    f = np.zeros((*slope.shape[:-2], 3, 3))
    f[..., :, :] = np.eye(3)
    f[..., :d, :d] += slope
    return _thickness(law, f) if law.plane_stress else f


def cell_response(law: NeoHooke, slope: Float, p: Float | None) -> tuple[Float, Float, Float, Float]:
    """In-plane stress (..., d, d), tangent (..., d, d, d, d), cofactor J F^-T (..., d, d) and J (...,)."""
    d = slope.shape[-1]
    f = deformation(law, slope)
    j = np.linalg.det(f)
    if not (j > 0.0).all():
        raise InvertedError
    stress, tangent = first_piola_and_tangent(law, f, p)
    if law.plane_stress:
        column, row = tangent[..., :, :, 2, 2], tangent[..., 2, 2, :, :]
        tangent = (
            tangent
            - np.einsum("...iJ,...kL->...iJkL", column, row) / tangent[..., 2, 2, 2, 2][..., None, None, None, None]
        )
    cofactor = j[..., None, None] * np.swapaxes(np.linalg.inv(f), -1, -2)
    return stress[..., :d, :d], tangent[..., :d, :d, :d, :d], cofactor[..., :d, :d], j


def assemble(
    mesh: Mesh, law: NeoHooke, unknowns: Float, pattern: Pattern, thickness: float = 1.0
) -> tuple[Stiffness, Float]:
    """Tangent (upper triangle) and internal forces (N,) at given unknowns (N,); raises InvertedError.

    The pattern must be mixed as the law is.
    """
    n, d = mesh.points.shape
    bary, w = quadrature(d, 2)
    hats = bary  # the linear shape functions
    u = unknowns[: n * d].reshape(n, d)
    vertices = pattern.vertices
    scale = pressure_scale(mesh, law.shear) if law.mixed else 1.0
    p_nodes = np.zeros(n)
    p_nodes[vertices] = scale * unknowns[n * d :]
    data = np.zeros(len(pattern.indices))
    force, p_force = np.zeros((n, d)), np.zeros(n)
    for part in cell_parts(mesh):
        cells = mesh.cells[part]
        gradients, det = mesh.element.physical_gradients(mesh.points[cells], bary)
        weights = det * (w * thickness)
        p = p_nodes[cells[:, : d + 1]] @ hats.T if law.mixed else None
        slope = np.einsum("eai,eqaJ->eqiJ", u[cells], gradients, optimize=True)
        stress, tangent, cofactor, j = cell_response(law, slope, p)
        np.add.at(force, cells, np.einsum("eq,eqiJ,eqaJ->eai", weights, stress, gradients, optimize=True))
        e, q, k, _ = gradients.shape
        weighted = (tangent * weights[:, :, None, None, None, None]).reshape(e, q, d * d * d, d)
        right = np.matmul(weighted, np.swapaxes(gradients, 2, 3)).reshape(e, q, d, d, d, k)  # i J k b
        right = np.ascontiguousarray(right.transpose(0, 1, 3, 2, 4, 5)).reshape(e, q * d, d * d * k)
        left = np.ascontiguousarray(gradients.transpose(0, 2, 1, 3)).reshape(e, k, q * d)
        pattern.add(data, part, np.matmul(left, right).reshape(e, k, d, d, k).transpose(0, 1, 2, 4, 3))
        if law.mixed and p is not None:
            flux = np.einsum("eqiJ,eqaJ->eqai", cofactor, gradients, optimize=True)
            coupling = scale * np.einsum("eq,qp,eqai->epai", weights, hats, flux, optimize=True)
            mass = -(scale**2) / law.bulk * np.einsum("eq,qp,qr->epr", weights, hats, hats, optimize=True)
            pattern.add_pressure(data, part, coupling, mass)
            np.add.at(p_force, cells[:, : d + 1], scale * (weights * (j - 1.0 - p / law.bulk)) @ hats)
    return Stiffness(pattern.matrix(data), vertices, scale), np.concatenate([force.ravel(), p_force[vertices]])


def stretch(mesh: Mesh, u: Float, point: Float, direction: Float) -> float:
    """Relative elongation |F d| - 1 at `point` (d,) along the unit `direction` (d,), mean over cells that hold it."""
    found = []
    for cell, bary in cells_at(mesh, point):
        nodes = mesh.cells[cell]
        slope = u[nodes].T @ mesh.element.physical_gradients(mesh.points[nodes][None], bary[None])[0][0, 0]
        found.append(np.linalg.norm(direction + slope @ direction) - 1.0)
    return float(np.mean(found))


def nodal_fields(mesh: Mesh, law: NeoHooke, unknowns: Float) -> tuple[Float, Float]:
    """Green-Lagrange strain and Cauchy stress (n, 3, 3) at the nodes, from the volume-weighted mean of F there."""
    size = mesh.points.size
    f = deformation(law, nodal_gradient(mesh, displacement(mesh, unknowns)))
    p = nodal_pressure(mesh, pressure_scale(mesh, law.shear) * unknowns[size:]) if law.mixed else None
    stress, _ = first_piola_and_tangent(law, f, p)
    cauchy = stress @ np.swapaxes(f, 1, 2) / np.linalg.det(f)[:, None, None]
    return 0.5 * (np.swapaxes(f, 1, 2) @ f - np.eye(3)), cauchy
