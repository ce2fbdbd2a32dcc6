"""Two friction coefficients: a slipping point is limited by ratio * mu.

mu_k < mu_s has no unique solution without a rule (validation/REFERENCES.md, 2.5).  ``keep``: a point that slips keeps
slipping at mu_k until its slip would reverse; this converges to the solution with mu_k.  ``paper``: in every step
all points start stuck and slip only above mu_s (Maeno 2004, Fig. 8); the solution depends on mesh and step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, get_args

import numpy as np
from annotated_types import Ge, Le

from finger3d._types import Float
from finger3d.contact.friction import SLIP, FrictionLaw, Status
from finger3d.effects.base import fill, warn
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model

Branch = Literal["keep", "paper"]


@dataclass(frozen=True)
class TwoCoefficients(FrictionLaw):
    """Friction law with the static coefficient ``mu`` and the kinetic one ``ratio * mu``."""

    ratio: float
    branch: Branch

    def __post_init__(self) -> None:
        if not 0.0 <= self.ratio <= 1.0:
            raise Finger3dError(f"ratio = {self.ratio}: must be a number from 0 to 1")
        if self.branch not in get_args(Branch):
            raise Finger3dError(f'branch = "{self.branch}": must be "keep" or "paper"')

    @property
    def depends_on_steps(self) -> bool:
        """True where every increment starts with all points stuck."""
        return self.branch == "paper"

    def coefficients(self, status: Status, pressure: Float) -> Float:
        """Return the kinetic coefficient for points that slip, if they keep it, and the static one elsewhere."""
        keeps = (status == SLIP) & (self.branch == "keep")
        return np.where(keeps, self.ratio, 1.0) * self.mu

    def updated(self, mu: Float, status: Status, pressure: Float) -> Float:
        """Lower the limit of points that slip; it is never raised within an increment, so this ends."""
        return np.where(status == SLIP, self.ratio * self.mu, mu)


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.kinetic_friction].

    Attributes
    ----------
    ratio : mu_kinetic / mu_static, 0 to 1
    branch : what a slipping point does in the next step
    """

    slot: ClassVar[str] = "friction"

    ratio: Annotated[float, Ge(0.0), Le(1.0)]
    branch: Branch = "keep"

    def apply(self, model: Model) -> Model:
        """Fill the friction slot."""
        model = fill(model, "friction", TwoCoefficients(model.friction.mu, self.ratio, self.branch), "kinetic_friction")
        if self.branch == "paper" and self.ratio < 1.0:
            model = warn(
                model,
                "kinetic_friction: branch 'paper' starts every step all stuck; its stick zone and friction depend on "
                "mesh and step",
            )
        return model
