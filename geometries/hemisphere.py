"""Half a ball on its flat side; meshed as a solid only. Runs alone: python geometries/hemisphere.py"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from finger3d._ranges import Dimension
from finger3d.geometry.design import ParametricDesign

if TYPE_CHECKING:
    from build123d import Solid


@dataclass(frozen=True)
class Hemisphere(ParametricDesign):
    """Half a ball on its flat side. It has no section: a solid, for the ftetwild mesher, only.

    Parameters
    ----------
    radius_mm : radius
    """

    name: ClassVar[str] = "hemisphere"

    radius_mm: Dimension

    @property
    def height_mm(self) -> float:
        """Height on the axis."""
        return self.radius_mm

    @property
    def half_length_mm(self) -> float:
        """Half the length along x."""
        return self.radius_mm

    @property
    def width_mm(self) -> float:
        """Largest width along z."""
        return 2.0 * self.radius_mm

    @property
    def volume_mm3(self) -> float:
        """Volume in closed form."""
        return 2.0 / 3.0 * math.pi * self.radius_mm**3

    def top(self, x: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the exact height y (n,) of the contact surface at x, z (n,), mm; nan outside the footprint."""
        square = self.radius_mm**2 - np.asarray(x, dtype=float) ** 2 - np.asarray(z, dtype=float) ** 2
        # Round-off from a mesh must not push a point on the rim out of the footprint.
        inside = square >= -1e-12 * self.radius_mm**2
        return np.where(inside, np.sqrt(np.maximum(square, 0.0)), np.nan)

    def solid(self) -> "Solid":
        """Return the build123d solid, its faces labelled."""
        from build123d import Rot, Sphere

        from finger3d.geometry.cad import sound

        return sound(Rot(-90, 0, 0) * Sphere(self.radius_mm, arc_size1=0, arc_size2=90, align=None), self.name)


if __name__ == "__main__":
    design = Hemisphere(radius_mm=5.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
