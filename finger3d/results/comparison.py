"""One model of a comparison, and what it says at the end of its path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from finger3d.accuracy.companions import FACTOR
from finger3d.errors import Outcome

FORCE = "force_N_per_mm"


@dataclass(frozen=True)
class Case:
    """What one model of the scene says at the end of its path.

    Attributes
    ----------
    model : plane stress, plane strain, solid, or solid with held ends
    size_mm : edge length at the contact
    numbers : quantity -> value, forces per width; see `measured`
    errors : quantity -> error bar by mesh and increments, as `finger3d press` has it; empty without one
    lines : line along x ("z = 0", "end") -> columns x_mm, pressure_MPa, shear_x_MPa, shear_z_MPa, status
    outcome : of the path; anything but CONVERGED leaves `numbers` empty
    companion : the numbers on the companion mesh
    ratio : how many times longer its edges are
    method : how the errors were estimated, or why not
    """

    model: str
    width_mm: float
    size_mm: float
    mesher: str
    outcome: Outcome
    numbers: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)
    lines: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    seconds: float = 0.0
    companion: Mapping[str, float] = field(default_factory=dict)
    ratio: float = FACTOR
    method: str = ""

    @property
    def ok(self) -> bool:
        """Whether there are numbers to compare."""
        return self.outcome.ok

    @property
    def is_section(self) -> bool:
        """Whether it is one of the two plane models."""
        return self.model.startswith("plane")

    def as_dict(self) -> dict[str, Any]:
        """For compare.json."""
        return {
            "model": self.model,
            "width_mm": self.width_mm,
            "size_mm": self.size_mm,
            "mesher": self.mesher,
            "outcome": str(self.outcome),
            "numbers": dict(self.numbers),
            "errors": dict(self.errors),
            "lines": {k: dict(v) for k, v in self.lines.items()},
            "seconds": self.seconds,
            "error_method": self.method,
        }
