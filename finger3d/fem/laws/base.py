"""Isochoric laws: their interface, their stability, and the nominal stress in the usual tests.

The Kirchhoff stress must do positive second-order work on any change of the logarithmic strains that keeps the volume
(Hill 1957; Abaqus applies the same test to hyperelastic constants).  In principal directions this is a 2 x 2 matrix.

The principal stretches have the product 1, and a pressure makes one face free of stress.  With W(l1, l2, l3) the
nominal (first Piola-Kirchhoff) stress along the first axis is ``P = dW/dl1 - l3/l1 dW/dl3 = (t1 - t3) / l1`` with the
Kirchhoff stresses ``t = l dW/dl`` (Treloar 1975, chap. 5; Ogden 1984, sec. 7.2)::

    uniaxial        l, 1/sqrt(l), 1/sqrt(l)
    equibiaxial     l, l, 1/l^2
    pure shear      l, 1, 1/l           of a wide, clamped strip (planar tension)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np
from scipy.optimize import brentq

from finger3d._types import Float, freeze_arrays


class IsochoricLaw(Protocol):
    """Isochoric part W(J^(-1/3) F) of a hyperelastic energy per volume at rest."""

    @property
    def shear(self) -> float:
        """Shear modulus at zero strain, MPa."""
        ...

    @property
    def is_stable(self) -> bool:
        """Whether the law is known to be stable at all strains (`finger3d.fem.laws.base`)."""
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


MODES = {
    "uniaxial tension": (1.0, -0.5, -0.5),
    "uniaxial compression": (-1.0, 0.5, 0.5),
    "equibiaxial tension": (0.5, 0.5, -1.0),
    "planar tension": (1.0, 0.0, -1.0),
}
"""Logarithmic strains of the usual tests: first that along which the sample is loaded, last one of a free face."""

_ISOCHORIC = np.array([[1.0, 1.0], [-1.0, 1.0], [0.0, -2.0]]) / np.sqrt([2.0, 6.0])
"""Orthonormal basis (3, 2) of the principal strains that keep the volume."""

_LARGEST_STRAIN, _GRID = 3.0, 301
"""Largest logarithmic strain at which a law is checked, and number of strains."""


def least_stiffness(law: IsochoricLaw, stretches: Float) -> Float:
    """Return the smallest stiffness (...,) at principal stretches (..., 3), over that at rest; 0 is the limit."""
    isochoric = stretches / np.cbrt(stretches.prod(axis=-1, keepdims=True))
    derivative = law.principal_stress(isochoric)[1]
    return np.asarray(np.linalg.eigvalsh(_ISOCHORIC.T @ derivative @ _ISOCHORIC)[..., 0] / (2.0 * law.shear))


def unstable_from(law: IsochoricLaw) -> dict[str, float]:
    """Return the nominal strain from which a law is unstable in each of the usual tests; stable tests are left out."""
    out = {}
    strains = np.linspace(0.0, _LARGEST_STRAIN, _GRID)
    for mode, direction in MODES.items():
        axis = np.array(direction) / abs(direction[0])

        def stiffness(strain: float, axis: Float = axis) -> float:
            return float(least_stiffness(law, np.exp(strain * axis)))

        falling = np.flatnonzero(least_stiffness(law, np.exp(strains[:, None] * axis)) <= 0.0)
        if len(falling):
            root = brentq(stiffness, strains[falling[0] - 1], strains[falling[0]]) if falling[0] else 0.0
            out[mode] = float(np.exp(root * axis[0]) - 1.0)
    return out


TESTS = {
    "tension": "uniaxial tension",
    "compression": "uniaxial compression",
    "shear": "planar tension",
    "equibiaxial": "equibiaxial tension",
}
"""Tests by mode; shear is pure shear."""

LARGEST_STRETCH, _STRETCHES = 10.0, 461
"""Stretch up to which stresses are followed (in compression its inverse), and number of stretches: 0.5 % apart."""


def principal_stretches(mode: str, stretch: Float) -> Float:
    """Return the principal stretches (..., 3) of a test: along the load first, across a free face last."""
    logs = np.array(MODES[TESTS[mode]])
    return np.asarray(stretch[..., None] ** (logs / logs[0]))


def nominal_stress(law: IsochoricLaw, stretches: Float) -> Float:
    """Return the nominal stress (...,) MPa along the first axis, which leaves the third one free of stress."""
    kirchhoff = law.kirchhoff(stretches)
    return np.asarray((kirchhoff[..., 0] - kirchhoff[..., 2]) / stretches[..., 0])


def rising_to(law: IsochoricLaw, mode: str) -> float:
    """Return the stretch to which a law is stable in a test, from 1, at most `LARGEST_STRETCH`.

    Its nominal stress rises with the stretch, and it satisfies Drucker's postulate (`finger3d.fem.laws.base`).
    """
    sign = -1.0 if mode == "compression" else 1.0
    stretch = LARGEST_STRETCH ** (sign * np.linspace(0.0, 1.0, _STRETCHES))
    stretches = principal_stretches(mode, stretch)
    rises = sign * np.diff(nominal_stress(law, stretches)) > 0.0
    stable = rises & (least_stiffness(law, stretches)[:-1] > 0.0)
    return float(stretch[_STRETCHES - 1 if stable.all() else stable.argmin()])
