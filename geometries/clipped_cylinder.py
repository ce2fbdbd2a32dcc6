"""The paper's Fig. 9 finger: a cylinder's top on straight walls. Runs alone: python geometries/clipped_cylinder.py"""

from dataclasses import dataclass
from typing import ClassVar

from finger3d._ranges import Dimension, Zero
from finger3d.geometry.design import ExtrudedDesign, check_at_most
from finger3d.geometry.section import Section, cylinder_section


@dataclass(frozen=True)
class ClippedCylinder(ExtrudedDesign):
    """A cylinder's top (axis along z), clipped at x = +-half_length and carried by walls edge_height high.

    Parameters
    ----------
    radius_mm : radius of the contact surface
    half_length_mm : half the length along x, at most the radius
    edge_height_mm : height of the walls; 0 to the radius
    width_mm : extrusion along z
    """

    name: ClassVar[str] = "clipped_cylinder"
    may_be_zero: ClassVar[tuple[str, ...]] = ("edge_height_mm",)

    radius_mm: Dimension
    half_length_mm: Dimension
    edge_height_mm: Zero | Dimension
    width_mm: Dimension

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("half_length_mm", "edge_height_mm"):
            check_at_most(self.name, self.dimensions, key, "radius_mm")

    @property
    def height_mm(self) -> float:
        """Height on the axis."""
        return self.section().height_mm

    def section(self) -> Section:
        """Return the section x >= 0."""
        return cylinder_section(self.radius_mm, self.half_length_mm, self.edge_height_mm)


if __name__ == "__main__":
    design = ClippedCylinder(radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
