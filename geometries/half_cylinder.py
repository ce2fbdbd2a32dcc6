"""The paper's R = 5 finger: half a cylinder on its flat side. Runs alone: python geometries/half_cylinder.py"""

from dataclasses import dataclass
from typing import ClassVar

from finger3d._ranges import Dimension
from finger3d.geometry.design import ExtrudedDesign
from finger3d.geometry.section import Section, cylinder_section


@dataclass(frozen=True)
class HalfCylinder(ExtrudedDesign):
    """Half a cylinder (axis along z) on its flat side.

    Parameters
    ----------
    radius_mm : radius
    width_mm : extrusion along z
    """

    name: ClassVar[str] = "half_cylinder"

    radius_mm: Dimension
    width_mm: Dimension

    @property
    def height_mm(self) -> float:
        """Height on the axis."""
        return self.radius_mm

    @property
    def half_length_mm(self) -> float:
        """Half the length along x."""
        return self.radius_mm

    def section(self) -> Section:
        """Return the section x >= 0."""
        return cylinder_section(self.radius_mm, self.radius_mm, 0.0)


if __name__ == "__main__":
    design = HalfCylinder(radius_mm=5.0, width_mm=10.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
