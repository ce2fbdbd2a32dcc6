"""Neo-Hookean law, W = G/2 (I1 - 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.base import Derivatives
from finger3d.fem.laws.invariants import InvariantLaw


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
