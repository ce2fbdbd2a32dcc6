"""A block with a flat top. Runs alone: python geometries/block.py"""

from dataclasses import dataclass
from typing import ClassVar

from finger3d._ranges import Dimension, Zero
from finger3d.geometry.design import ExtrudedDesign, check_layer
from finger3d.geometry.section import Section, block_section, with_layer


@dataclass(frozen=True)
class Block(ExtrudedDesign):
    """A rectangular block; its top face is the contact surface.

    Parameters
    ----------
    half_length_mm : half the length along x
    height_mm : height along y
    width_mm : extrusion along z
    skin_mm : thickness of a layer under the top face, the part "skin"; 0 for none
    """

    name: ClassVar[str] = "block"
    may_be_zero: ClassVar[tuple[str, ...]] = ("skin_mm",)

    half_length_mm: Dimension
    height_mm: Dimension
    width_mm: Dimension
    skin_mm: Zero | Dimension = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_layer(self.name, block_section(self.half_length_mm, self.height_mm), self.skin_mm)

    def section(self) -> Section:
        """Return the section x >= 0."""
        outline = block_section(self.half_length_mm, self.height_mm)
        return with_layer(outline, self.skin_mm) if self.skin_mm else outline


if __name__ == "__main__":
    design = Block(half_length_mm=20.0, height_mm=20.0, width_mm=20.0)
    print(design)
    print(f"height {design.height_mm:.4f} mm, volume {design.volume_mm3:.3f} mm3, CAD {design.solid().volume:.3f} mm3")
