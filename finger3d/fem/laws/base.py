"""Interface of the hyperelastic laws, and the base class of those that depend on the invariants of deformation."""

from __future__ import annotations

from typing import NamedTuple, Protocol, Self

from finger3d._types import Float


class IsochoricLaw(Protocol):
    """Isochoric part W(J^(-1/3) F) of a hyperelastic energy per volume at rest."""

    @property
    def shear(self) -> float:
        """Shear modulus at zero strain, MPa."""
        ...

    @property
    def is_stable(self) -> bool:
        """Whether the law is known to be stable at all strains (`finger3d.fem.laws.stability`)."""
        ...

    def with_shear(self, shear: float) -> Self:
        """Return the law with another shear modulus (MPa); all stresses are proportional to it."""
        ...

    def energy(self, f: Float) -> Float:
        """Return the energy (...,) MPa of deformation gradients (..., 3, 3), det F > 0."""
        ...

    def stress(self, f: Float) -> Float:
        """Return the first Piola-Kirchhoff stress dW/dF (..., 3, 3) MPa."""
        ...

    def stress_and_tangent(self, f: Float) -> tuple[Float, Float]:
        """Return the stress and its derivative d2W/dF dF (..., 3, 3, 3, 3) MPa."""
        ...

    def principal_stress(self, stretches: Float) -> tuple[Float, Float]:
        """Return principal Kirchhoff stresses of isochoric principal stretches (..., 3), and their derivative.

        Returns
        -------
        stress : (..., 3) MPa, up to a pressure
            dW/d(ln lambda), with the three stretches taken as independent.
        derivative : (..., 3, 3) MPa, by the logarithms of the stretches
        """
        ...


class Derivatives(NamedTuple):
    """First and second derivatives (...,) MPa of an energy by two invariants; None for what is zero everywhere."""

    w1: Float
    w2: Float | None = None
    w11: Float | None = None
    w12: Float | None = None
    w22: Float | None = None
