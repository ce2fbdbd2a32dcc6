"""Error bars of the numbers of a press: the discretisation error plus the error of the increments; and their texts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

from finger3d._types import Tree, TreeView

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
        return {
            "discretisation": dict(self.discretisation),
            "steps": dict(self.steps),
            "modulus": dict(self.modulus),
            "method": self.method,
            "seconds": self.seconds,
        }


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
