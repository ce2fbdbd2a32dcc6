"""Result of one model of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from finger3d._types import Tree, TreeView
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.companions import FACTOR
from finger3d.mechanics.readings import Column, named

FORCE = "force_N_per_mm"

SHOWN = named(
    FORCE,
    "contact_length_mm",
    "stick_length_mm",
    "friction_sum_N_per_mm",
    "friction_along_x_N_per_mm",
    "friction_along_z_N_per_mm",
    "peak_pressure_MPa",
)
"""Quantities that tables and figures of a comparison show."""


@dataclass(frozen=True)
class Case:
    """Result of one model of the scene at the end of the path.

    Attributes
    ----------
    model : plane stress, plane strain, or solid
    size_mm : edge length at the contact
    numbers : quantity -> value, forces per width; see `finger3d.analyses.compare.quantities`
    strains : columns of the strains among the numbers
    errors : quantity -> error bar of mesh and increments; empty if it was not estimated
    lines : line along x ("z = 0", "end") -> columns x_mm, pressure_MPa, shear_x_MPa, shear_z_MPa, status
    outcome : `numbers` is empty unless it is CONVERGED
    companion : quantities on the companion mesh
    ratio : edge length of the companion mesh relative to this one's
    method : method of the error estimate, or why there is none
    """

    model: str
    width_mm: float
    size_mm: float
    mesher: str
    outcome: Outcome
    numbers: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)
    lines: Mapping[str, TreeView] = field(default_factory=dict)
    seconds: float = 0.0
    companion: Mapping[str, float] = field(default_factory=dict)
    ratio: float = FACTOR
    method: str = ""
    strains: Sequence[Column] = ()

    @property
    def ok(self) -> bool:
        """Whether the path converged."""
        return self.outcome.ok

    @property
    def is_section(self) -> bool:
        """Whether it is plane stress or plane strain."""
        return self.model.startswith("plane")

    def as_dict(self) -> Tree:
        """Return the entry of compare.json."""
        kept = ("model", "width_mm", "size_mm", "mesher", "outcome", "numbers", "errors", "lines", "seconds")
        return {name: getattr(self, name) for name in kept} | {
            "outcome": str(self.outcome),
            "error_method": self.method,
        }
