"""Stiffness of embedded gauges: every gauge is a thin foil in the body, stiff along its length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from finger3d._ranges import Length, Modulus, at_most
from finger3d.effects import fill
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Foils, Model


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.embedded_gauge]: the foil of every [[gauge]].

    Attributes
    ----------
    E_MPa : Young's modulus along the foil
    thickness_mm, width_mm : its section
    """

    slot: ClassVar[str] = "inclusions"

    E_MPa: Modulus
    thickness_mm: Length
    width_mm: Length

    def apply(self, model: Model) -> Model:
        """Fill the slot of the inclusions; every gauge must be a foil inside the finger."""
        here = "effects.embedded_gauge"
        if not model.gauges:
            raise Finger3dError(f"{here}: the scene has no [[gauge]]; add one, or take the effect out")
        names = {gauge.name for gauge in model.gauges}
        for i, gauge in enumerate(model.gauges):
            if gauge.is_point:
                raise Finger3dError(f"gauge.{i}.length_mm = 0.0: must be above 0 with {here}: a foil has a length")
            if f"{gauge.name}_free" in names:
                raise Finger3dError(
                    f'gauge.name = "{gauge.name}_free": {here} gives this name to the free strain of "{gauge.name}"; '
                    "choose another"
                )
            room = 0.5 * model.design.width_mm - abs(gauge.z_mm)
            if 0.5 * self.width_mm > room:
                raise Finger3dError(
                    f'{here}.width_mm = {self.width_mm}: gauge "{gauge.name}" would stick out of the finger; '
                    f"must be at most {at_most(2.0 * room)} there"
                )
        if self.thickness_mm > model.mesh.size_mm:
            raise Finger3dError(
                f"{here}.thickness_mm = {self.thickness_mm}: thicker than an element; must be at most mesh.size_mm = "
                f"{model.mesh.size_mm}, or the mesh coarser"
            )
        return fill(model, "inclusions", Foils(self.E_MPa, self.thickness_mm, self.width_mm), "embedded_gauge")
