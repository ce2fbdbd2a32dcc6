"""The paper's Fig. 9 finger: a cylinder's top on straight walls. Runs alone: python geometries/clipped_cylinder.py"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from finger3d._ranges import Dimension, Zero
from finger3d.geometry.rules import check_at_most, check_dimensions
from finger3d.geometry.section import Section, cylinder_section


@dataclass(frozen=True)
class ClippedCylinder:
    """A cylinder's top (axis along z), clipped at x = +-half_length and carried by walls edge_height high.

    Parameters
    ----------
    radius_mm : radius of the contact surface
    half_length_mm : half the length along x, at most the radius
    edge_height_mm : height of the walls; 0 to the radius
    width_mm : extrusion along z
    """

    name: ClassVar[str] = "clipped_cylinder"

    radius_mm: Dimension
    half_length_mm: Dimension
    edge_height_mm: Zero | Dimension
    width_mm: Dimension

    def __post_init__(self) -> None:
        check_dimensions(self, zero_allowed=("edge_height_mm",))
        check_at_most(self, "half_length_mm", "radius_mm")
        check_at_most(self, "edge_height_mm", "radius_mm")

    @property
    def height_mm(self) -> float:
        """Height on the axis."""
        return self.section().height_mm

    @property
    def volume_mm3(self) -> float:
        """Closed-form volume."""
        return self.section().area_mm2 * self.width_mm

    def section(self) -> Section:
        """The half section, for structured meshes."""
        return cylinder_section(self.radius_mm, self.half_length_mm, self.edge_height_mm)

    def top(self, x: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Exact height y (n,) of the contact surface at x, z (n,), mm; nan outside the footprint."""
        return self.section().top(x, z, self.width_mm)

    def solid(self) -> Any:
        """The build123d solid."""
        from finger3d.geometry.cad import extruded

        return extruded(self.section(), self.width_mm, self.name)


if __name__ == "__main__":
    design = ClippedCylinder(radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
