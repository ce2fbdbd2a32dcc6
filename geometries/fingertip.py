"""A clipped cylinder with a skin and a core, cast of several materials. Runs alone: python geometries/fingertip.py"""

from dataclasses import dataclass
from typing import ClassVar

from finger3d._ranges import Dimension, Zero
from finger3d.geometry.design import ExtrudedDesign, check_at_most, check_core, check_layer
from finger3d.geometry.section import Core, Section, cylinder_section, with_core, with_layer


@dataclass(frozen=True)
class Fingertip(ExtrudedDesign):
    """A cylinder's top on straight walls, cast of several materials: parts "skin" and "core", and the main body.

    Parameters
    ----------
    radius_mm : radius of the contact surface
    half_length_mm : half the length along x, at most the radius
    edge_height_mm : height of the walls; 0 to the radius
    width_mm : extrusion along z
    skin_mm : thickness of the skin under the contact face, from wall to wall; 0 for none
    core_half_length_mm : half the length along x of the core; 0 for none
    core_height_mm : height of the core, which stands on the base; 0 for none
    """

    name: ClassVar[str] = "fingertip"
    may_be_zero: ClassVar[tuple[str, ...]] = ("edge_height_mm", "skin_mm", "core_half_length_mm", "core_height_mm")

    radius_mm: Dimension
    half_length_mm: Dimension
    edge_height_mm: Zero | Dimension
    width_mm: Dimension
    skin_mm: Zero | Dimension = 0.0
    core_half_length_mm: Zero | Dimension = 0.0
    core_height_mm: Zero | Dimension = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("half_length_mm", "edge_height_mm"):
            check_at_most(self.name, self.dimensions, key, "radius_mm")
        check_layer(self.name, self._outline, self.skin_mm)
        check_core(self.name, self._with_skin, self.core_half_length_mm, self.core_height_mm)

    @property
    def height_mm(self) -> float:
        """Height on the axis."""
        return self._outline.height_mm

    @property
    def _outline(self) -> Section:
        return cylinder_section(self.radius_mm, self.half_length_mm, self.edge_height_mm)

    @property
    def _with_skin(self) -> Section:
        return with_layer(self._outline, self.skin_mm) if self.skin_mm else self._outline

    def section(self) -> Section:
        """Return the section x >= 0."""
        if not self.core_height_mm:
            return self._with_skin
        return with_core(self._with_skin, Core(self.core_half_length_mm, self.core_height_mm))


if __name__ == "__main__":
    design = Fingertip(10.0, 8.0, 8.0, 16.0, skin_mm=1.0, core_half_length_mm=3.0, core_height_mm=6.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
    for label, solid in design.solids().items():
        print(f"{label or 'main body'}: CAD {solid.volume:.3f} mm3")
