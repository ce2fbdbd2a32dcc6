"""Materials and the linear elastic law that the stiffness is assembled from.

A new material is one class with the methods of `Material`, and one law with those of `LinearElasticity`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from finger3d._types import Float, Int

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


class LinearElasticity(Protocol):
    """Linear elastic law of a solid or a section: stress ``C : eps + p I``.

    In the displacement form C is the whole law and p = 0. In the mixed form p is an unknown field with
    ``p = pressure_modulus div(u)``, and C is the rest.
    """

    @property
    def mixed(self) -> bool:
        """Whether the pressure is an unknown of its own."""
        ...

    @property
    def shear_modulus(self) -> float:
        """A shear modulus, MPa: the size of the stiffness, by which pressures are scaled."""
        ...

    @property
    def pressure_modulus(self) -> float | Float:
        """Pressure per dilatation of the mixed form, MPa; (e,) if it differs between cells."""
        ...

    def of_cells(self, cells: slice | Int) -> LinearElasticity:
        """Return the law of some of the cells of the body."""
        ...

    def contract(self, outer: Float) -> Float:
        """Return element matrices ``sum_mn C_imjn A_ambn`` (e, k, d, k, d) from A (e, k, d, k, d).

        A are the integrals of ``G_am G_bn``, with the gradients G of the shape functions a and b.
        """
        ...

    def stress(self, strain: Float) -> Float:
        """Return ``C : strain`` (n, d, d), MPa; if laws differ between cells, of equally many strains in each cell."""
        ...


class Material(Protocol):
    """Elastic material of a body."""

    @property
    def is_nearly_incompressible(self) -> bool:
        """Whether solids and plane strain need the mixed form."""
        ...

    def elasticity(self, plane_stress: bool = False, mixed: bool | None = None) -> LinearElasticity:
        """Return the small-strain law; in plane stress with the strain across the section condensed.

        Parameters
        ----------
        mixed : the form; None chooses it by `is_nearly_incompressible`
        """
        ...

    def across(self, strain: Float, stress: Float, plane_strain: bool) -> tuple[Float, Float]:
        """Return strain and stress (n,) across a section from the in-plane ones (n, 2, 2)."""
        ...

    def isotropic(self, user: str) -> Isotropic:
        """Return the material itself if it is isotropic.

        Raises
        ------
        Finger3dError
            If it is not; the message names the `user` that needs it, such as ``"effects.large_deformation"``.
        """
        ...


@dataclass(frozen=True)
class Elasticity:
    """Isotropic linear elasticity, ``lame tr(eps) I + 2 shear eps``, by its constants in MPa."""

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

    @property
    def shear_modulus(self) -> float:
        """The shear modulus, MPa."""
        return self.shear

    @property
    def pressure_modulus(self) -> float:
        """Lame's first constant, MPa."""
        return self.lame

    def of_cells(self, cells: slice | Int) -> Elasticity:
        """Return the law itself: it is the same in all cells."""
        return self

    def contract(self, outer: Float) -> Float:
        """Return element matrices ``lame A_aibj + shear (A_ajbi + delta_ij A_ambm)``, lame only without pressures."""
        cell = self.shear * np.swapaxes(outer, 2, 4)
        if self.lame and not self.mixed:
            cell += self.lame * outer
        laplace = self.shear * np.einsum("eaibi->eab", outer)
        for i in range(outer.shape[2]):
            cell[:, :, i, :, i] += laplace
        return np.asarray(cell)

    def stress(self, strain: Float) -> Float:
        """Return ``2 shear eps + lame tr(eps) I``, lame only without pressures."""
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
        """Whether nu is close to 1/2."""
        return self.nu >= MIXED_FROM

    def elasticity(self, plane_stress: bool = False, mixed: bool | None = None) -> Elasticity:
        """Return the law of a solid or plane strain, or of plane stress."""
        return Elasticity.of(self.E_MPa, self.nu, plane_stress, mixed)

    def across(self, strain: Float, stress: Float, plane_strain: bool) -> tuple[Float, Float]:
        """Return strain and stress (n,) across a section: ``s_zz = nu tr(s)`` or ``e_zz = -nu/E tr(s)``."""
        in_plane = np.trace(stress, axis1=1, axis2=2)
        zero = np.zeros(len(stress))
        return (zero, self.nu * in_plane) if plane_strain else (-self.nu / self.E_MPa * in_plane, zero)

    def isotropic(self, user: str) -> Isotropic:
        """Return the material."""
        return self
