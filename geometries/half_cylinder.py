"""The paper's R = 5 finger: half a cylinder on its flat side. Runs alone: python geometries/half_cylinder.py"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from finger3d._ranges import Dimension
from finger3d.geometry.rules import check_dimensions
from finger3d.geometry.section import Section, cylinder_section


@dataclass(frozen=True)
class HalfCylinder:
    """Half a cylinder (axis along z) on its flat side.

    Parameters
    ----------
    radius_mm : radius
    width_mm : extrusion along z
    """

    name: ClassVar[str] = "half_cylinder"

    radius_mm: Dimension
    width_mm: Dimension

    def __post_init__(self) -> None:
        check_dimensions(self)

    @property
    def height_mm(self) -> float:
        """Height on the axis."""
        return self.radius_mm

    @property
    def half_length_mm(self) -> float:
        """Half the length along x."""
        return self.radius_mm

    @property
    def volume_mm3(self) -> float:
        """Closed-form volume."""
        return self.section().area_mm2 * self.width_mm

    def section(self) -> Section:
        """The half section, for structured meshes."""
        return cylinder_section(self.radius_mm, self.radius_mm, 0.0)

    def top(self, x: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Exact height y (n,) of the contact surface at x, z (n,), mm; nan outside the footprint."""
        return self.section().top(x, z, self.width_mm)

    def solid(self) -> Any:
        """The build123d solid."""
        from finger3d.geometry.cad import extruded

        return extruded(self.section(), self.width_mm, self.name)


if __name__ == "__main__":
    design = HalfCylinder(radius_mm=5.0, width_mm=10.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
