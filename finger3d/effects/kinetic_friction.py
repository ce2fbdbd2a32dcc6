"""Two friction coefficients: a slipping point is limited by ratio * mu."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from annotated_types import Ge, Le

from finger3d.contact.friction import Branch, TwoCoefficients
from finger3d.effects import fill, warn
from finger3d.mechanics.model import Model


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.kinetic_friction].

    Attributes
    ----------
    ratio : mu_kinetic / mu_static, 0 to 1
    branch : what a slipping point does in the next increment
    """

    slot: ClassVar[str] = "friction"

    ratio: Annotated[float, Ge(0.0), Le(1.0)]
    branch: Branch = "keep"

    def apply(self, model: Model) -> Model:
        """Fill the friction slot."""
        if self.ratio == 1.0:  # Coulomb's law, in whichever branch
            return fill(model, "friction", model.friction, "kinetic_friction")
        model = fill(model, "friction", TwoCoefficients(model.friction.mu, self.ratio, self.branch), "kinetic_friction")
        if self.branch == "paper":
            model = warn(
                model,
                "kinetic_friction: branch 'paper' starts every increment all stuck; its stick zone and friction depend "
                "on mesh and increments",
            )
        return model
