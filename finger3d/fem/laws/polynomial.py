"""Laws that are polynomials of the isochoric invariants: neo-Hooke, Mooney-Rivlin and Yeoh.

With the shear modulus G::

    neo-Hooke        W = G/2 (I1 - 3)
    Mooney-Rivlin    W = c10 (I1 - 3) + c01 (I2 - 3),           2 (c10 + c01) = G
    Yeoh             W = sum of c_i (I1 - 3)^i, i = 1, 2, 3,    2 c1 = G
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.invariants import Derivatives, InvariantLaw


@dataclass(frozen=True)
class NeoHooke(InvariantLaw):
    """Neo-Hookean law (Treloar 1943)."""

    @property
    def is_stable(self) -> bool:
        """True."""
        return True

    def of_invariants(self, x1: Float, x2: Float) -> Float:
        """Return G/2 (I1 - 3)."""
        return np.asarray(0.5 * self.shear * (x1 - 3.0))

    def derivatives(self, x1: Float, x2: Float) -> Derivatives:
        """Return the derivative G/2."""
        return Derivatives(np.full_like(x1, 0.5 * self.shear))


@dataclass(frozen=True)
class MooneyRivlin(InvariantLaw):
    """Mooney-Rivlin law (Mooney 1940).

    Attributes
    ----------
    c01_share : c01 over c10 + c01
    """

    c01_share: float

    @property
    def is_stable(self) -> bool:
        """Whether no constant is negative."""
        return 0.0 <= self.c01_share <= 1.0

    def of_invariants(self, x1: Float, x2: Float) -> Float:
        """Return c10 (I1 - 3) + c01 (I2 - 3)."""
        half = 0.5 * self.shear
        return np.asarray(half * ((1.0 - self.c01_share) * (x1 - 3.0) + self.c01_share * (x2 - 3.0)))

    def derivatives(self, x1: Float, x2: Float) -> Derivatives:
        """Return c10 and c01."""
        half = 0.5 * self.shear
        return Derivatives(np.full_like(x1, half * (1.0 - self.c01_share)), np.full_like(x1, half * self.c01_share))


@dataclass(frozen=True)
class Yeoh(InvariantLaw):
    """Yeoh's law (Yeoh 1993).

    Attributes
    ----------
    c2_over_c1, c3_over_c1 : ratios of its constants
    """

    c2_over_c1: float
    c3_over_c1: float

    @property
    def is_stable(self) -> bool:
        """Whether no constant is negative."""
        return self.c2_over_c1 >= 0.0 and self.c3_over_c1 >= 0.0

    def of_invariants(self, x1: Float, x2: Float) -> Float:
        """Return the polynomial of I1 - 3."""
        e = x1 - 3.0
        return np.asarray(0.5 * self.shear * e * (1.0 + e * (self.c2_over_c1 + e * self.c3_over_c1)))

    def derivatives(self, x1: Float, x2: Float) -> Derivatives:
        """Return the polynomial's derivatives."""
        e, c1 = x1 - 3.0, 0.5 * self.shear
        slope = c1 * (1.0 + e * (2.0 * self.c2_over_c1 + 3.0 * e * self.c3_over_c1))
        return Derivatives(np.asarray(slope), w11=np.asarray(c1 * (2.0 * self.c2_over_c1 + 6.0 * e * self.c3_over_c1)))
