"""Estimated changes of the numbers of a press by a better model, each with its own error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

from finger3d._types import Tree
from finger3d.accuracy.error_bars import largest, spacing
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import AREAS, MAIN, Kind, by_key, kinds_of

_SURE = 1.0 / 3.0
"""Relative error up to which a change is significant: the true change is then within a factor of 1.5 of it."""

_UNRESOLVED = 0.3
"""Error of the place of a border of contact or stick over the distance of the contact points, on a coarse mesh."""

_LEAST_CHANGE = 0.01
"""Least significant change, over the natural scale of the number."""


@dataclass(frozen=True)
class Change:
    """Estimated change of a number.

    Attributes
    ----------
    value : the number in the press
    change : what is to be added to it, in the same unit
    error : half-width of the interval of `change`
    scale : natural scale of the number, see `natural_scales`
    """

    value: float
    change: float
    error: float
    scale: float

    @property
    def low(self) -> float:
        """Lower end of the interval of `change`."""
        return self.change - self.error

    @property
    def high(self) -> float:
        """Upper end of the interval of `change`."""
        return self.change + self.error

    @property
    def relative(self) -> float:
        """The change over the natural scale; 0 where that is 0."""
        return self.change / self.scale if self.scale else 0.0

    @property
    def significant(self) -> bool:
        """Whether the interval is narrow and the change large enough to be reported."""
        return self.error <= _SURE * abs(self.change) and abs(self.relative) >= _LEAST_CHANGE


@dataclass(frozen=True, kw_only=True)
class ChangeEstimate:
    """Estimated changes of a press.

    Attributes
    ----------
    changes : changes of forces, lengths, areas and readings by name
    method : one line that says how the changes were estimated, or ``no estimate: ...``
    """

    changes: Mapping[str, Change] = field(default_factory=dict)
    method: str = ""

    @property
    def significant(self) -> dict[str, Change]:
        """The changes that are known well enough to be reported."""
        return {name: change for name, change in self.changes.items() if change.significant}

    def of_press(self, numbers: Mapping[str, float]) -> Self:
        """Return the changes of a press with these numbers, from which those of the coarse presses differ."""
        changes = {
            name: replace(c, value=numbers[name], error=max(c.error, abs(numbers[name] - c.value)))
            for name, c in self.changes.items()
            if name in numbers
        }
        return replace(self, changes=changes)

    def as_dict(self) -> Tree:
        """Return the entry of summary.json: change, and the ends of its interval, by number."""
        return {name: {"change": c.change, "low": c.low, "high": c.high} for name, c in self.changes.items()}


def two_digits(value: float) -> str:
    """Return a change with its sign and two digits, without a power of ten unless it is tiny or huge."""
    return f"{float(f'{value:.2g}'):+g}"


def changing_numbers(problem: Problem, step: StepResult) -> dict[str, float]:
    """Return the numbers whose changes are estimated, by name: forces, lengths, areas, readings, and a depth found."""
    measured = measure(problem.points, step)
    numbers = {name: float(measured[name]) for name in (*MAIN, *AREAS)} | by_key(step.readings)
    return {"depth_mm": step.target.depth_mm, **numbers} if problem.model.ends_at_force else numbers


def natural_scales(model: Model, depth_mm: float, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return the scale by name relative to which a change of a number of a press counts.

    It is the number itself for forces, extents of contact and the depth; for others what the number is a part of: mu
    times the normal force for friction, contact for stick, the largest strain that is read or the depth over the height
    for strains, the depth for displacements, and the mean pressure on the base for taxels.
    """
    kinds, force, design = kinds_of(model.columns), abs(numbers["normal_force_N"]), model.design
    numbers = {name: value for name, value in numbers.items() if name in kinds}  # without strains of free gauges
    base = 2.0 * design.half_length_mm * design.width_mm

    def scale(name: str) -> float:
        match kinds[name]:
            case Kind.FRICTION_SUM:
                return max(abs(numbers[name]), model.friction.largest * force)
            case Kind.CONTACT_LENGTH | Kind.STICK_LENGTH:
                return abs(numbers["contact_half_length_mm"])
            case Kind.CONTACT_AREA | Kind.STICK_AREA:
                return abs(numbers["contact_area_mm2"])
            case Kind.STRAIN:
                return max(largest(numbers, kinds, Kind.STRAIN), depth_mm / design.height_mm)
            case Kind.DISPLACEMENT:
                return max(largest(numbers, kinds, Kind.DISPLACEMENT), depth_mm)
            case Kind.BASE_PRESSURE:
                return max(largest(numbers, kinds, Kind.BASE_PRESSURE), force / base)
        return abs(numbers[name])

    return {name: scale(name) for name in numbers if math.isfinite(numbers[name])}


def unresolved(problem: Problem, step: StepResult, scales: Mapping[str, float]) -> dict[str, float]:
    """Return the changes of lengths and areas by name that contact points do not resolve.

    Parameters
    ----------
    scales : natural scales of the numbers, see `natural_scales`
    """
    kinds, share = kinds_of(problem.model.columns), _UNRESOLVED * spacing(problem, step)
    return {name: share * scale for name, scale in scales.items() if kinds[name].is_zone}
