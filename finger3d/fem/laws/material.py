"""Isotropic materials, and the linear elastic laws from which stiffness is assembled, one in each part of a body."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from finger3d._types import Float, Int, freeze_arrays
from finger3d.fem.mesh import Mesh

MIXED_FROM = 0.48
"""Poisson's ratio from which the mixed form is used: near 1/2 linear elements lock (validation/cook.py), and the
pressure of quadratic ones oscillates."""

LEAST_COMPRESSIBILITY = 1e-7
"""Least compressibility, in units of 1/G.

It keeps every pivot of the mixed form away from zero at nu = 0.5 and changes results by about 1e-7 (relative).
"""

LARGEST_COMPRESSIBILITY = 1e7
"""Largest compressibility of the mixed form, in units of 1/G.

It keeps the pressures finite at nu = 0, where another part of the body is nearly incompressible.
"""

RIGID_RATIO = 1e5
"""Young's modulus of a rigid part over the largest of the other parts.

Forces deviate by some 2e-5 from those of a part that keeps its shape exactly.
"""


@dataclass(frozen=True)
class Elasticity:
    """Isotropic linear elasticity, ``lame tr(eps) I + 2 shear eps``, by its constants in MPa.

    In the mixed form the pressure ``lame div(u)`` is an unknown field.
    """

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
            max((1.0 - 2.0 * nu) * (1.0 + nu) / (E_MPa * nu), LEAST_COMPRESSIBILITY / shear) if nu else np.inf
        )
        is_mixed = nu >= MIXED_FROM if mixed is None else mixed
        if is_mixed:
            compressibility = min(compressibility, LARGEST_COMPRESSIBILITY / shear)
        return cls(shear, 1.0 / compressibility, is_mixed)

    def of_cells(self, cells: slice | Int) -> Elasticity:
        """Return the law itself: it is the same in all cells."""
        return self

    def contract(self, outer: Float) -> Float:
        """Return element matrices ``lame A_aibj + shear (A_ajbi + delta_ij A_ambm)``, lame only without pressures.

        A (e, k, d, k, d) are the integrals of ``G_am G_bn``, with the gradients G of the shape functions a and b.
        """
        cell = self.shear * np.swapaxes(outer, 2, 4)
        if self.lame and not self.mixed:
            cell += self.lame * outer
        laplace = self.shear * np.einsum("eaibi->eab", outer)
        for i in range(outer.shape[2]):
            cell[:, :, i, :, i] += laplace
        return np.asarray(cell)

    def stress(self, strain: Float) -> Float:
        """Return ``2 shear eps + lame tr(eps) I`` (n, d, d), MPa, lame only without pressures."""
        deviator = 2.0 * self.shear * strain
        if self.mixed:
            return deviator
        return np.asarray(
            deviator + (self.lame * np.trace(strain, axis1=1, axis2=2))[:, None, None] * np.eye(strain.shape[-1])
        )


@dataclass(frozen=True)
class Isotropic:
    """Isotropic elasticity.

    Attributes
    ----------
    E_MPa : float
        Young's modulus, MPa.
    nu : float
        Poisson's ratio, 0 <= nu <= 0.5.
    """

    E_MPa: float
    nu: float

    @property
    def is_nearly_incompressible(self) -> bool:
        """Whether solids and plane strain need the mixed form: nu is close to 1/2."""
        return self.nu >= MIXED_FROM

    def elasticity(self, plane_stress: bool = False, mixed: bool | None = None) -> Elasticity:
        """Return the law of a solid or plane strain, or of plane stress.

        Parameters
        ----------
        mixed : the form; None chooses it by `is_nearly_incompressible`
        """
        return Elasticity.of(self.E_MPa, self.nu, plane_stress, mixed)

    def across(self, strain: Float, stress: Float, plane_strain: bool) -> tuple[Float, Float]:
        """Return strain and stress (n,) across a section: ``s_zz = nu tr(s)`` or ``e_zz = -nu/E tr(s)``."""
        in_plane = np.trace(stress, axis1=1, axis2=2)
        zero = np.zeros(len(stress))
        return (zero, self.nu * in_plane) if plane_strain else (-self.nu / self.E_MPa * in_plane, zero)


def elasticity_of(materials: Sequence[Isotropic], mesh: Mesh, plane_stress: bool) -> LinearElasticity:
    """Return the small-strain law of a body.

    Parameters
    ----------
    materials : of the parts by their number, the main body first
    mesh : whose cells know their parts

    Notes
    -----
    All parts take the mixed form if one of them is nearly incompressible. Their pressures are discontinuous at
    interfaces.
    """
    if mesh.part is None:
        return materials[0].elasticity(plane_stress)
    mixed = not plane_stress and any(material.is_nearly_incompressible for material in materials)
    return ElasticityByPart(tuple(m.elasticity(plane_stress, mixed) for m in materials), mesh.part)


def moduli_of(elastic: LinearElasticity) -> tuple[float, ...]:
    """Return the shear modulus of each part by its number, MPa."""
    laws = elastic.laws if isinstance(elastic, ElasticityByPart) else (elastic,)
    return tuple(law.shear for law in laws)


def contact_compliance(elastic: LinearElasticity, mesh: Mesh) -> Float:
    """Return the contact compliance ``1 / E*``, 1/MPa, at the nodes (n,) of a mesh, the mean over the cells around it.

    With Lame's constants l and G it is ``(l + 2 G) / (4 G (l + G))``: ``(1 - nu^2) / E``, or ``1 / E`` in plane stress.
    """
    shear = np.array(moduli_of(elastic))[elastic.part if isinstance(elastic, ElasticityByPart) else 0]
    lame = elastic.lame
    of_cell = np.broadcast_to((lame + 2.0 * shear) / (4.0 * shear * (lame + shear)), len(mesh.cells))
    nodes, each = mesh.cells.ravel(), mesh.cells.shape[1]
    count = np.bincount(nodes, minlength=len(mesh.points))
    total = np.bincount(nodes, np.repeat(of_cell, each), len(mesh.points))
    return np.asarray(total / np.maximum(count, 1))


@dataclass(frozen=True)
class ElasticityByPart:
    """Linear elastic laws of a body of several parts; see `finger3d.fem.laws.material.Elasticity`.

    Attributes
    ----------
    laws : of the parts by their number, all in the same form
    part : (e,) number of the part of each cell
    """

    laws: tuple[Elasticity, ...]
    part: Int

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def mixed(self) -> bool:
        """Whether the pressure is an unknown of its own."""
        return self.laws[0].mixed

    @property
    def shear(self) -> float:
        """Shear modulus of the main body, MPa, by which pressures are scaled."""
        return self.laws[0].shear

    @property
    def lame(self) -> Float:
        """Lame's first constant in each cell (e,), MPa."""
        return np.array([law.lame for law in self.laws])[self.part]

    def of_cells(self, cells: slice | Int) -> LinearElasticity:
        """Return the law of some cells, that of their part if they belong to one."""
        part = self.part[cells]
        return self.laws[part[0]] if len(part) and (part == part[0]).all() else ElasticityByPart(self.laws, part)

    def contract(self, outer: Float) -> Float:
        """Return the element matrices of all cells; see `finger3d.fem.laws.material.Elasticity.contract`."""
        return _by_part(self.part, lambda number, values: self.laws[number].contract(values), outer)

    def stress(self, strain: Float) -> Float:
        """Return the stress (e k, d, d), MPa, of k strains in each cell."""
        part = np.repeat(self.part, len(strain) // max(len(self.part), 1))
        return _by_part(part, lambda number, values: self.laws[number].stress(values), strain)


LinearElasticity: TypeAlias = Elasticity | ElasticityByPart
"""Linear elastic law of a body."""


def _by_part(part: Int, function: Callable[[int, Float], Float], values: Float) -> Float:
    """Return a function of part and values (k, ...), of the shape of the values, applied part by part."""
    out = np.empty_like(values)
    for number in np.unique(part):
        in_part = part == number
        out[in_part] = function(int(number), values[in_part])
    return out
