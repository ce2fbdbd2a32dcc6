"""Mooney-Rivlin law, W = c10 (I1 - 3) + c01 (I2 - 3) with 2 (c10 + c01) = G."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.base import Derivatives
from finger3d.fem.laws.invariants import InvariantLaw


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
