"""Friction laws: which coefficient limits each point, and when that choice must be revised."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

OPEN, STICK, SLIP = 0, 1, 2
STATUS_NAMES = ("open", "stick", "slip")


class FrictionLaw(Protocol):
    """What the contact solution asks of friction: a limit for every point, and when to revise it."""

    @property
    def static(self) -> float:
        """Coefficient that a sticking point may not exceed."""
        ...

    def coefficients(self, status: NDArray[np.int8]) -> NDArray[np.float64]:
        """Coefficient (c,) that a step starts with, from the status (c,) at its begin."""
        ...

    def revised(self, mu: NDArray[np.float64], status: NDArray[np.int8]) -> NDArray[np.float64] | None:
        """Coefficients to solve again with, given the status (c,) found with `mu` (c,); None when consistent."""
        ...


@dataclass(frozen=True)
class Coulomb:
    """Coulomb friction with one coefficient (Maeno 2004, Eqs. 3 and 4); 0 is frictionless."""

    mu: float = 0.0

    @property
    def static(self) -> float:
        """Coefficient that a sticking point may not exceed."""
        return self.mu

    def coefficients(self, status: NDArray[np.int8]) -> NDArray[np.float64]:
        """Coefficient (c,) that a step starts with, from the status (c,) at its begin."""
        return np.full(len(status), self.mu)

    def revised(self, mu: NDArray[np.float64], status: NDArray[np.int8]) -> NDArray[np.float64] | None:
        """Coefficients to solve again with, given the status (c,) found with `mu` (c,); None when consistent."""
        return None
