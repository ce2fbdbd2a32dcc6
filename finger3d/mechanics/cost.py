"""Estimated cost of a press, and what an effect adds to it.

The seconds are calibrated on 2 cores by validation/cost_of_accuracy.py and scaling.py, and good to a factor 2.
"""

from __future__ import annotations

from dataclasses import dataclass

FACTORISATIONS = 3
"""Factorisations of the tangent in an increment at finite strain, typical of the studies of large deformation."""


@dataclass(frozen=True, kw_only=True)
class PressCost:
    """Estimated cost of a press without effects.

    Attributes
    ----------
    dim : 2 or 3
    dofs, contact_points : size of the meshed part
    increments : number of increments in all runs
    runs : number of runs, each with another number of increments
    seconds : time of each stage by name
    factor_mb : memory of the factor
    """

    dim: int
    dofs: float
    contact_points: float
    increments: int
    runs: int
    seconds: dict[str, float]
    factor_mb: float


@dataclass(frozen=True, kw_only=True)
class AddedCost:
    """Seconds and memory that an effect adds to a press, and the reason."""

    seconds: float = 0.0
    memory_mb: float = 0.0
    reason: str = "no factorisation and no further step"

    def __str__(self) -> str:
        return f"about {self.seconds:.2g} s and {self.memory_mb:.2g} MB: {self.reason}"
