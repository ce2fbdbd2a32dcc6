"""A block with a flat top. Runs alone: python geometries/block.py"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from finger3d._ranges import Dimension
from finger3d.geometry.rules import check_dimensions
from finger3d.geometry.section import Section, block_section


@dataclass(frozen=True)
class Block:
    """A rectangular block; its top face is the contact surface.

    Parameters
    ----------
    half_length_mm : half the length along x
    height_mm : height along y
    width_mm : extrusion along z
    """

    name: ClassVar[str] = "block"

    half_length_mm: Dimension
    height_mm: Dimension
    width_mm: Dimension

    def __post_init__(self) -> None:
        check_dimensions(self)

    @property
    def volume_mm3(self) -> float:
        """Closed-form volume."""
        return self.section().area_mm2 * self.width_mm

    def section(self) -> Section:
        """The half section, for structured meshes."""
        return block_section(self.half_length_mm, self.height_mm)

    def top(self, x: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Exact height y (n,) of the contact surface at x, z (n,), mm; nan outside the footprint."""
        return self.section().top(x, z, self.width_mm)

    def solid(self) -> Any:
        """The build123d solid."""
        from finger3d.geometry.cad import extruded

        return extruded(self.section(), self.width_mm, self.name)


if __name__ == "__main__":
    design = Block(half_length_mm=20.0, height_mm=20.0, width_mm=20.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
