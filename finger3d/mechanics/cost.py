"""Estimated cost of a press, and what an effect adds to it.

The seconds are calibrated on 2 cores by validation/cost_of_accuracy.py and scaling.py, and good to a factor
2.5.
"""

from __future__ import annotations

from dataclasses import dataclass

from finger3d.mechanics.model import Model

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


_FOIL_ROWS = {2: 16, 3: 96}
"""Condensed rows of a foil with its mirror images, by dimension."""

_FOIL_S = {2: 0.02, 3: 0.2}
"""Seconds to discretise a foil, by dimension."""


def added_cost(slot: str, model: Model, press: PressCost) -> AddedCost:
    """Return the cost that the effect in a slot of the model adds; a friction law adds none."""
    match slot:
        case "hyperelastic_law":
            return AddedCost(
                seconds=press.increments * finite_strain_s(press.dofs, press.seconds["condensation"]),
                memory_mb=press.factor_mb,
                reason=f"about one factorisation and nine iterations in each of {press.increments} steps",
            )
        case "relaxation" if model.refactorises and not model.finite_strain:
            lengths = _lengths_of_time_step(model, press)
            return AddedCost(
                seconds=lengths * press.seconds["condensation"] + press.seconds["assembly"],
                memory_mb=lengths * press.factor_mb,
                reason=f"{lengths} more factorisation{'s' * (lengths > 1)}, one for each length of step",
            )
        case "inclusions":
            foils, d = len(model.gauges), press.dim
            rows = _FOIL_ROWS[d] * foils
            share = min(rows / max(d * press.contact_points, 1.0), 1.0)
            return AddedCost(
                seconds=share * press.seconds["condensation"] + press.seconds["contact"] + _FOIL_S[d] * foils,
                memory_mb=40e-6 * rows**2,
                reason=f"{rows} more rows, and every step once more without the foils",
            )
        case "object_compliance":
            return AddedCost(
                seconds=press.seconds["condensation"] + press.seconds["assembly"] + press.seconds["mesh"],
                memory_mb=0.5 * press.factor_mb,
                reason="the object is meshed and condensed like the finger; taken to be of its size",
            )
    return AddedCost()


def _lengths_of_time_step(model: Model, press: PressCost) -> int:
    """Return the number of different lengths of the increments of time, each of which has a factor of its own."""
    fixed = {leg.duration_s / leg.steps for leg in model.legs if leg.duration_s and leg.steps != "auto"}
    automatic = {leg.duration_s for leg in model.legs if leg.steps == "auto"}
    return max(len(fixed) + press.runs * len(automatic), 1)


def state_size(model: Model, press: PressCost) -> float:
    """Return how many numbers the state of the body holds: its unknowns, and its internal variables if it relaxes.

    At finite strain these are 9 at 4 points of each of some dofs / 4.5 cells.
    """
    branches = len(model.relaxation.prony) if model.relaxation else 0
    if model.finite_strain:
        return press.dofs * (1.0 + 8.0 * (branches + 1 if branches else 0))
    if model.relaxation is None:
        return 0.0
    return (1 + branches) * (press.dim * press.contact_points if model.relaxation.bulk else press.dofs)
