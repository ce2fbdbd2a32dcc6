"""Estimated cost of a press, and what an effect adds to it.

The seconds are calibrated on 2 cores by validation/cost_of_accuracy.py and scaling.py, and good to a factor
2.5.
"""

from __future__ import annotations

from dataclasses import dataclass

_FACTORISATIONS, _ITERATIONS = 1.0, 9
"""Factorisations of the tangent and iterations of an increment at finite strain, typical of smooth fingers."""

_NUMERIC_FACTORISATION = 0.85
"""Time of a factorisation whose ordering is known, with the assembly of its tangent, over that of a condensation."""

_ITERATION_S = 2.8e-6
"""Seconds of an iteration for each unknown: a residual, and a forward and a backward substitution."""


def finite_strain_s(dofs: float, condensation_s: float) -> float:
    """Return the modelled seconds of an increment at finite strain."""
    return _FACTORISATIONS * _NUMERIC_FACTORISATION * condensation_s + _ITERATIONS * _ITERATION_S * dofs


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
