"""A block with a flat top. Runs alone: python geometries/block.py"""

from dataclasses import dataclass
from typing import ClassVar

from finger3d._ranges import Dimension
from finger3d.geometry.design import ExtrudedDesign
from finger3d.geometry.section import Section, block_section


@dataclass(frozen=True)
class Block(ExtrudedDesign):
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

    def section(self) -> Section:
        """Return the section x >= 0."""
        return block_section(self.half_length_mm, self.height_mm)


if __name__ == "__main__":
    design = Block(half_length_mm=20.0, height_mm=20.0, width_mm=20.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
