"""Two friction coefficients: a slipping point is limited by ratio * mu.

mu_k < mu_s has no unique answer without a rule (validation/REFERENCES.md, 2.5).  ``keep``: a point that slips keeps
slipping at mu_k until its slip would reverse; this converges to the solution with mu_k.  ``paper``: every step starts
all stuck, so that a point is asked for mu_s again in each step (Maeno 2004, Fig. 8); its answer depends on mesh and
step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le
from numpy.typing import NDArray

from finger3d.contact.friction import SLIP
from finger3d.effects.base import fill, warn
from finger3d.mechanics.model import Model

Float = NDArray[np.float64]
Branch = Literal["keep", "paper"]


@dataclass(frozen=True)
class TwoCoefficients:
    """Friction law with a static coefficient and a kinetic one, ``ratio`` times smaller."""

    static: float
    ratio: float
    branch: Branch

    def coefficients(self, status: NDArray[np.int8]) -> Float:
        """Coefficient (c,) that a step starts with, from the status (c,) at its begin."""
        keeps = (status == SLIP) & (self.branch == "keep")
        return np.where(keeps, self.ratio, 1.0) * self.static

    def revised(self, mu: Float, status: NDArray[np.int8]) -> Float | None:
        """Lower the limit of points found slipping; it is never raised within a step, so this ends."""
        lower = np.where(status == SLIP, self.ratio * self.static, mu)
        return None if np.array_equal(lower, mu) else lower


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.kinetic_friction].

    Attributes
    ----------
    ratio : mu_kinetic / mu_static, 0 to 1
    branch : what a slipping point does in the next step
    """

    ratio: Annotated[float, Ge(0.0), Le(1.0)]
    branch: Branch = "keep"

    def apply(self, model: Model) -> Model:
        """Fill the friction slot."""
        model = fill(
            model, "friction", TwoCoefficients(model.friction.static, self.ratio, self.branch), "kinetic_friction"
        )
        if self.branch == "paper" and self.ratio < 1.0:
            model = warn(
                model,
                "kinetic_friction: branch 'paper' starts every step all stuck; its stick zone and friction depend on "
                "mesh and step",
            )
        return model
