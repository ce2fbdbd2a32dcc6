"""Interface of the isochoric laws, and the law of a body whose shear modulus differs from point to point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, Self

from finger3d._types import Float, freeze_arrays


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

    def stress(self, f: Float) -> Float:
        """Return the first Piola-Kirchhoff stress dW/dF (..., 3, 3) MPa."""
        ...

    def stress_and_tangent(self, f: Float) -> tuple[Float, Float]:
        """Return the stress and its derivative d2W/dF dF (..., 3, 3, 3, 3) MPa."""
        ...

    def kirchhoff(self, stretches: Float) -> Float:
        """Return principal Kirchhoff stresses (..., 3) MPa of isochoric principal stretches (..., 3), up to a pressure.

        Here constants of the law may be arrays that broadcast with the points (...,).
        """
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


@dataclass(frozen=True)
class Inhomogeneous:
    """A law with a shear modulus for each of m points, at which it is evaluated; see `IsochoricLaw`.

    Attributes
    ----------
    law : with the shear modulus by which stresses are scaled
    relative : (m,) shear modulus of each point over that of the law
    """

    law: IsochoricLaw
    relative: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def shear(self) -> float:
        """Shear modulus by which stresses are scaled, MPa."""
        return self.law.shear

    @property
    def is_stable(self) -> bool:
        """Whether the law is stable at all strains: the shear modulus does not matter."""
        return self.law.is_stable

    def with_shear(self, shear: float) -> Self:
        """Return the law with another shear modulus by which stresses are scaled, MPa."""
        return replace(self, law=self.law.with_shear(shear))

    def of_points(self, points: slice) -> Inhomogeneous:
        """Return the law at some of the points."""
        return Inhomogeneous(self.law, self.relative[points])

    def stress(self, f: Float) -> Float:
        """Return the first Piola-Kirchhoff stress (m, 3, 3) MPa."""
        return self.relative[:, None, None] * self.law.stress(f)

    def stress_and_tangent(self, f: Float) -> tuple[Float, Float]:
        """Return the stress and its derivative (m, 3, 3, 3, 3) MPa."""
        stress, tangent = self.law.stress_and_tangent(f)
        return self.relative[:, None, None] * stress, self.relative[:, None, None, None, None] * tangent

    def kirchhoff(self, stretches: Float) -> Float:
        """Return principal Kirchhoff stresses (m, 3) MPa."""
        return self.relative[:, None] * self.law.kirchhoff(stretches)

    def principal_stress(self, stretches: Float) -> tuple[Float, Float]:
        """Return principal Kirchhoff stresses (m, 3) and their derivative (m, 3, 3), MPa."""
        stress, derivative = self.law.principal_stress(stretches)
        return self.relative[:, None] * stress, self.relative[:, None, None] * derivative
