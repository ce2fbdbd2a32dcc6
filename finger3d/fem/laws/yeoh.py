"""Yeoh's law, W = sum of c_i (I1 - 3)^i for i = 1, 2, 3, with 2 c1 = G."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.base import Derivatives
from finger3d.fem.laws.invariants import InvariantLaw


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
