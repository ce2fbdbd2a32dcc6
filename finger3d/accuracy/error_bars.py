"""Error bars: the discretisation error, from the spread of a number over meshes, plus that of the increments.

If the error of a number q falls as h^p with the edge length h, its error and the number q_k on a mesh with edges of k h
are related by ::

    error of q = |q - q_k| / |k^p - 1|

A single difference is small by chance in one of five numbers.  The error bar is therefore the root mean square over
several companions, times a factor fitted to drawn scenes (validation/error_bars.py) ::

    bar of q = c root mean square over k of |q - q_k| / |k^p - 1|

The order p of forces is that of quadratic elements at a bonded corner, p = 2 lambda, where displacements go as
distance^lambda (Williams 1952).  Numbers that depend less on the corners have a higher order.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Self

import numpy as np

from finger3d._types import Tree, TreeView
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.readings import ORDER, Column, Kind, kinds_of

_LEAST = 0.001
"""Least relative error over h/a, for points of distance h in a contact of half-length a: all companions may agree."""

_LEAST_OF_ZONES = 0.02
"""The same for lengths and areas of contact and stick, which points on the border enter or leave unseen."""

_LEAST_OF_STICK = 0.15
"""The same for stick where all points stick: a ring of slip that is narrower than their distance is unseen."""

_LEAST_SLIP = 0.1
"""Share of the work for that of few points that slip unseen."""


_IF_ZERO = {
    Kind.STICK_AREA: "contact_area_mm2",
    Kind.FRICTION_SUM: "normal_force_N",
    Kind.DISSIPATION: "external_work_mJ",
}
_NOTHING = 1e-9  # of the number in its place, below which a number is zero


def largest(numbers: Mapping[str, float], kinds: Mapping[str, Kind], kind: Kind) -> float:
    """Return the largest magnitude of all numbers of a kind, 0 without any."""
    return max((abs(v) for k, v in numbers.items() if kinds[k] is kind), default=0.0)


def scale_of(numbers: Mapping[str, float], kinds: Mapping[str, Kind], name: str) -> float:
    """Return the magnitude to which an error of a number is relative.

    For a reading it is the largest of its kind, for a length that of contact, for a component of the force the normal
    force, and for a moment the normal force at the end of contact at least, since those vanish in symmetric presses.
    Where nothing sticks or slips, it is the area of contact, the normal force and the work for areas, friction and
    dissipation.
    """
    kind = kinds[name]
    scale = largest(numbers, kinds, kind) if kind.is_reading else abs(numbers[name])
    force, reach = abs(numbers.get("normal_force_N", 0.0)), numbers.get("contact_half_length_mm", scale)
    if kind in (Kind.CONTACT_LENGTH, Kind.STICK_LENGTH):
        return reach
    if kind is Kind.FORCE:
        return force
    if kind in (Kind.SHARE, Kind.MARGIN):
        return 1.0
    if kind is Kind.MOMENT:
        return max(scale, force * reach)
    whole = abs(numbers.get(_IF_ZERO.get(kind, name), 0.0))
    return whole if scale <= _NOTHING * whole else scale


def relative_error(numbers: Mapping[str, float], kinds: Mapping[str, Kind], name: str, error: float) -> float:
    """Return the relative error of a number, see `scale_of`."""
    scale = scale_of(numbers, kinds, name)
    return error / scale if scale > 0.0 else (math.inf if error > 0.0 else 0.0)


def gain(ratio: float, order: float = ORDER) -> float:
    """Return the difference to the companion over the error, for a `ratio` of edge lengths, companion over mesh."""
    return abs(math.pow(ratio, order) - 1.0)


def spacing(problem: Problem, step: StepResult) -> float:
    """Return the distance of the contact points over the half-length of contact, at most 1."""
    points, reach = problem.points, measure(problem.points, step)["contact_half_length_mm"]
    touching = step.state.force[:, 0] > 0.0
    area = float(np.median(points.area[touching])) if touching.any() else math.inf
    distance = math.sqrt(area) if points.dim == 3 else area / (2.0 * points.half_width_mm)
    return min(1.0, distance / reach) if reach > 0.0 else 1.0


def spread(kind: Kind, value: float, others: Sequence[tuple[float, float]]) -> float:
    """Return the error bar of a number of a kind from edge lengths over that of the mesh, and its values there."""
    errors = [(value - other) / gain(ratio, kind.order) for ratio, other in others]
    return kind.bar_factor * math.sqrt(sum(error**2 for error in errors) / len(errors))


def spread_error(
    numbers: Mapping[str, float],
    companions: Iterable[tuple[float, Mapping[str, float]]],
    readings: Iterable[Column] = (),
    spacing: float = 0.0,
) -> dict[str, float]:
    """Return the discretisation error by name, from the spread of a number over several meshes.

    Parameters
    ----------
    numbers : of the press, by name
    companions : edge length over that of the mesh (below 1 for a finer one), and numbers by name, of every companion
    readings : columns of the readings among the numbers
    spacing : distance of the contact points over the half-length of contact, see `spacing`

    Returns
    -------
    dict
        Errors in the units of the numbers; names without a finite error are left out.
    """
    kinds, told = kinds_of(readings), list(companions)
    found = {}
    for name, value in numbers.items():
        bar = spread(kinds[name], value, [(ratio, other[name]) for ratio, other in told])
        found[name] = max(bar, least_error(numbers, kinds, name, spacing))
    return {name: error for name, error in found.items() if math.isfinite(error)}


def least_error(numbers: Mapping[str, float], kinds: Mapping[str, Kind], name: str, spacing: float) -> float:
    """Return the error that the distance of the contact points leaves open, whatever other meshes say.

    Parameters
    ----------
    spacing : distance of the contact points over the half-length of contact, see `spacing`
    """
    scale, kind = scale_of(numbers, kinds, name), kinds[name]
    if kind is Kind.DISSIPATION and abs(numbers[name]) < scale:  # nothing slips
        scale *= _LEAST_SLIP
    if kind.is_stick and numbers.get("stick_ratio_area", 0.0) >= 1.0 - _NOTHING:  # nothing slips
        return _LEAST_OF_STICK * spacing * scale
    return (_LEAST_OF_ZONES if kind.is_zone else _LEAST) * spacing * scale


_ROUND_OFF = 1e-15
"""Relative round-off of a number."""


@dataclass(frozen=True, kw_only=True)
class ErrorBars:
    """Estimated errors by name, each in the unit of its number.

    Attributes
    ----------
    discretisation : error of the mesh
    steps : error of the increments
    modulus : error due to the spread of Young's modulus, not part of `total`
    method : one line that says how the errors were estimated, or ``no estimate: ...``
    seconds : wall time of the estimate
    """

    discretisation: Mapping[str, float] = field(default_factory=dict)
    steps: Mapping[str, float] = field(default_factory=dict)
    modulus: Mapping[str, float] = field(default_factory=dict)
    method: str = ""
    seconds: float = 0.0

    @classmethod
    def of_summary(cls, summary: TreeView) -> Self:
        """Read the error bars of a summary.json; without names if the press made no estimate."""
        known = summary.get("error_estimate") or {}
        mesh, steps, modulus = (
            {name: float(error) for name, error in (known.get(part) or {}).items() if error is not None}
            for part in ("discretisation", "steps", "modulus")
        )
        method, seconds = str(known.get("method", "")), float(known.get("seconds") or 0.0)
        return cls(discretisation=mesh, steps=steps, modulus=modulus, method=method, seconds=seconds)

    @property
    def covered(self) -> str:
        """The errors that `totals` are the sums of, in words."""
        return "error of mesh and increments" if self.steps else "error of the mesh without that of the increments"

    def totals(self) -> dict[str, float]:
        """Return the sums of both errors by name."""
        return {name: error + self.steps.get(name, 0.0) for name, error in self.discretisation.items()}

    def as_dict(self) -> Tree:
        """Return the entries of summary.json."""
        return {own.name: getattr(self, own.name) for own in fields(ErrorBars)}


def with_error(value: float, error: float | None = None, digits: int = 5, sign: str = "±") -> str:
    """Return a number and its error, both to the second digit of the error.

    Parameters
    ----------
    error : in the unit of the value; None or not finite: unknown
    digits : significant digits of a number whose error is unknown or below its round-off
    sign : what stands before the error

    Examples
    --------
    >>> with_error(304.36368, 1.9)
    '304.4 ± 1.9'
    >>> with_error(0.034024128)
    '0.034024'
    >>> with_error(3.4e-8, 1e-9)
    '(3.40 ± 0.10) 1e-8'
    """
    if error is None or not (math.isfinite(error) and math.isfinite(value)):
        return f"{value:.{digits}g}"
    if error <= _ROUND_OFF * abs(value):
        return f"{value:.{digits}g} {sign} 0"
    places = 1 - math.floor(math.log10(error))
    power = math.floor(math.log10(max(abs(value), error)))
    if places > 6 and power < 0:
        scale = 10.0**power
        return f"({with_error(value / scale, error / scale, digits, sign)}) 1e{power}"
    value, error = round(value, places) + 0.0, round(error, places)  # no negative zero
    return f"{value:.{max(places, 0)}f} {sign} {error:.{max(places, 0)}f}"
