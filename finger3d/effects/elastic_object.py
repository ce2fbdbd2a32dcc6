"""Elastic object: its compliance is added to that of the finger at the contact points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from finger3d._ranges import Length, Modulus, Poisson
from finger3d.effects import fill, warn
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import ElasticObject, Model


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.elastic_object].

    Attributes
    ----------
    E_MPa, nu : the object's material
    height_mm : thickness of the block behind a plane, wedge or wave; the finger's height unless given
    """

    slot: ClassVar[str] = "object_compliance"

    E_MPa: Modulus
    nu: Poisson
    height_mm: Length | None = None

    def apply(self, model: Model) -> Model:
        """Fill the slot of the object's compliance."""
        obj = model.object
        if self.height_mm is not None and not obj.is_face:
            raise Finger3dError(
                "effects.elastic_object.height_mm: only for a plane, wedge or wave, which are the face of a block; a "
                "cylinder, a sphere and a mesh are held where they are cut, or on top; take it out"
            )
        if not obj.has_section and model.domain != "solid":
            raise Finger3dError('effects.elastic_object: a mesh as object has no section; set model.domain = "solid"')
        if obj.is_turned:
            raise Finger3dError(
                "effects.elastic_object: not with a turned object; take turn_x_deg, turn_y_deg and turn_z_deg out"
            )
        deepest = max((leg.depth_mm for leg in model.legs if leg.force_N is None), default=0.0)
        if deepest > obj.held_height_mm:
            raise Finger3dError(
                f"press.depth_mm = {deepest:g}: deeper than the elastic object, which is held {obj.held_height_mm:g} "
                "mm above its lowest point; press less deep, or take [effects.elastic_object] out"
            )
        soft = ElasticObject(self.E_MPa, self.nu, self.height_mm)
        model = fill(model, "object_compliance", soft, "elastic_object")
        if any(leg.moves_sideways for leg in model.legs):
            model = warn(
                model,
                "elastic_object: the object's shape moves, its compliance stays that of where it was touched first",
            )
        return model
