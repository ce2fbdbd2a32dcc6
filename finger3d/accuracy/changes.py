"""Estimated changes of the numbers of a press by a better model, each with its own error."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from finger3d._types import Tree
from finger3d.accuracy.cost import forecast, without_output_s
from finger3d.accuracy.richardson import Kind, relative_error
from finger3d.contact.rules import STEP_DEPENDENT_RULES
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.columns import AREAS, MAIN, by_key
from finger3d.mechanics.results.history import StepResult, measure

FAILURES = Finger3dError, RuntimeError, ValueError, np.linalg.LinAlgError, MemoryError
"""Errors of presses that an estimate makes, which then tells no changes."""

_SURE = 1.0 / 3.0
"""Relative error up to which a change is significant: the true change is then within a factor of 1.5 of it."""

_LEAST_CHANGE = 0.01
"""Least significant relative change, see `finger3d.accuracy.richardson.relative_error`."""

_FACTORS = (2.0, 2.83, 4.0)
"""Edge lengths of a coarse mesh over those of the press; the first that is cheap enough is taken."""


@dataclass(frozen=True)
class Change:
    """Estimated change of a number.

    Attributes
    ----------
    value : the number in the press
    change : what is to be added to it, in the same unit
    error : half-width of the interval of `change`
    relative : change over the scale that errors of such a number are relative to
    significant : whether the interval is narrow and the change large enough to be reported
    """

    value: float
    change: float
    error: float
    relative: float
    significant: bool

    @property
    def low(self) -> float:
        """Lower end of the interval of `change`."""
        return self.change - self.error

    @property
    def high(self) -> float:
        """Upper end of the interval of `change`."""
        return self.change + self.error


@dataclass(frozen=True, kw_only=True)
class ChangeEstimate:
    """Estimated changes of a press.

    Attributes
    ----------
    changes : changes of forces, lengths, areas and readings by name; empty if there is no estimate
    method : one line that says how the changes were estimated, or ``no estimate: ...``
    seconds : wall time of the estimate
    resolution : of changes of lengths and areas by the contact points of the presses, by name
    """

    changes: Mapping[str, Change] = field(default_factory=dict)
    method: str = ""
    seconds: float = 0.0
    resolution: Mapping[str, float] = field(default_factory=dict)

    @property
    def significant(self) -> dict[str, Change]:
        """The changes that are known well enough to be reported."""
        return {name: change for name, change in self.changes.items() if change.significant}

    def as_dict(self) -> Tree:
        """Return the entry of summary.json: change, and the ends of its interval, by number."""
        return {name: {"change": c.change, "low": c.low, "high": c.high} for name, c in self.changes.items()}


def affordable_factor(coarse: Callable[[float], Model], budget_s: float, first: Sequence[float] = ()) -> float:
    """Return the edge lengths of a coarse mesh over those of the press, whose modelled cost is within a budget.

    Parameters
    ----------
    coarse : function of this factor that returns the model of the coarse press
    first : factors to be tried before those of a coarse mesh

    Raises
    ------
    Finger3dError
        If all coarse presses cost more.
    """
    for factor in (*first, *_FACTORS):
        if without_output_s(forecast(coarse(factor))) <= budget_s:
            return factor
    raise Finger3dError(f"it would take more than {budget_s:.2g} s")


def two_digits(value: float) -> str:
    """Return a change with its sign and two digits, without a power of ten unless it is tiny or huge."""
    return f"{float(f'{value:.2g}'):+g}"


def changing_numbers(problem: Problem, step: StepResult) -> dict[str, float]:
    """Return the numbers whose changes are estimated, by name: forces, lengths, areas, readings, and a depth found."""
    measured = measure(problem.points, step)
    numbers = {name: float(measured[name]) for name in (*MAIN, *AREAS)} | by_key(step.readings)
    return {"depth_mm": step.target.depth_mm, **numbers} if problem.model.ends_at_force else numbers


def judged(
    values: Mapping[str, float], changes: Mapping[str, float], errors: Mapping[str, float], kinds: Mapping[str, Kind]
) -> dict[str, Change]:
    """Return the changes by name that are finite; those known within a factor of 1.5 and large are significant.

    Parameters
    ----------
    values : numbers of the press by name, as `changing_numbers` returns them
    changes, errors : estimated change of each, and half-width of its interval
    kinds : of the numbers
    """
    out = {}
    for name, value in values.items():
        change, error = changes[name], errors[name]
        if all(map(math.isfinite, (value, change, error))):
            relative = relative_error(values, kinds, name, change)
            significant = error <= _SURE * abs(change) and _LEAST_CHANGE <= abs(relative) < math.inf
            out[name] = Change(value, change, error, relative, significant)
    return out


def check_kind(model: Model) -> None:
    """Raise an error for a kind of press on which the estimates have not been validated.

    Raises
    ------
    Finger3dError
        For a model with an effect, a prescribed force or a triangulated object, and where the result depends on the
        number of increments.
    """
    if model.filled:
        names = ", ".join(name for _, name in model.filled)
        raise Finger3dError(f"it was not compared with presses under {names}")
    if not model.object.has_section:  # on coarse meshes its details may keep an increment from settling for minutes
        raise Finger3dError("it was not compared with presses on triangulated objects")
    if model.is_under_force:
        raise Finger3dError("it was not compared with presses to a force")
    if model.rule in STEP_DEPENDENT_RULES or model.friction.depends_on_steps:
        raise Finger3dError("the result depends on the number of increments")
