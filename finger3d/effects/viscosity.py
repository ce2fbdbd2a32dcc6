"""Viscoelasticity: moduli that relax as a Prony series r(t) = 1 - sum g_i (1 - exp(-t/tau_i)), E_MPa at t = 0."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from annotated_types import MinLen

from finger3d._ranges import Fraction, Seconds
from finger3d.effects import fill, warn
from finger3d.errors import Finger3dError
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.mechanics.model import Model

_ROUNDING = 5e-3
"""Largest excess over 1 of a sum of relative moduli that is taken for rounding."""

_LEAST_LONG_TIME = 1e-6
"""Least long-time modulus over E: a body without one would be a liquid."""


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.viscosity].

    Attributes
    ----------
    prony : (relative modulus, time in s) of every branch; the rest is the long-time modulus
    bulk : whether the bulk modulus relaxes too, so that nu is constant; else only the shear modulus does
    """

    slot: ClassVar[str] = "relaxation"

    prony: Annotated[tuple[tuple[Fraction, Seconds], ...], MinLen(1)]
    bulk: bool = True

    def __post_init__(self) -> None:
        """Refuse a series whose long-time modulus is negative by more than the rounding of a data sheet."""
        if self._total > 1.0 + _ROUNDING:
            raise Finger3dError(
                f"prony: the relative moduli sum to {self._total:.6g}; must be below 1, the rest is the long-time "
                "modulus"
            )

    @property
    def _total(self) -> float:
        return math.fsum(share for share, _ in self.prony)

    def apply(self, model: Model) -> Model:
        """Set the relaxation of the model; every leg needs a duration."""
        most = 1.0 - _LEAST_LONG_TIME
        scale = min(most / self._total, 1.0)
        prony = tuple((share * scale, time) for share, time in self.prony)
        if scale < 1.0:
            model = warn(
                model,
                f"effects.viscosity.prony: the relative moduli sum to {self._total:.6g}, taken as rounded: they are "
                f"scaled to {most:g}, and almost nothing is left of E at long times",
            )
        relaxation = Relaxation(prony, self.bulk)
        model = fill(model, "relaxation", relaxation, "viscosity")
        timeless = [i for i, leg in enumerate(model.legs) if leg.duration_s is None]
        if timeless:
            which = f"press.leg.{timeless[0]}.duration_s" if len(model.legs) > 1 else "press.duration_s"
            raise Finger3dError(f"{which} is missing: with effects.viscosity every leg needs its duration in seconds")
        relaxation.check_domain(model.domain)
        return model
