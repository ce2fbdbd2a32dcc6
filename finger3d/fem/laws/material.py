"""Isotropic materials, and the linear elastic law that the stiffness is assembled from."""

from __future__ import annotations

from dataclasses import dataclass

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
