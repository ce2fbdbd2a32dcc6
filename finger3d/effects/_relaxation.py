"""Workspace of bodies whose stiffness depends on the length of the time step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import scipy.sparse as sp

from finger3d.fem.condense import Condensation
from finger3d.mechanics.formulation import Workspace

_FACTORS_KEPT = 5
"""Number of condensations kept; each holds a factor, and a path rarely has more than four lengths of step."""


@dataclass
class RelaxationWorkspace(Workspace):
    """Condensed bodies for the last time steps, by alpha, and the shear part of the stiffness."""

    shear_part: sp.csr_matrix | None = None
    _condensations: dict[float, Condensation] = field(default_factory=dict)

    def condensation(self, alpha: float, make: Callable[[], Condensation]) -> Condensation:
        """Return the condensation for alpha, made unless it is one of the last few."""
        found = self._condensations.pop(alpha, None)
        if found is None:
            found = make()
            self.factorizations += found.factorizations
        self._condensations[alpha] = found
        if len(self._condensations) > _FACTORS_KEPT:
            self._condensations.pop(next(iter(self._condensations)))
        return found
