"""Seal along the parting faces: a tongue in a groove, or a groove for a cord of silicone.

The seal follows the outline of the cavities in the parting plane of the halves, and the outline of their bases under
the lid. Both grooves are part of regions between two offsets of these outlines.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from finger3d.geometry.surface import Triangles
from finger3d.mold.features import Feature
from finger3d.mold.layout import Layout
from finger3d.mold.options import TONGUE_HEIGHT_MM, TONGUE_MM, MoldOptions
from finger3d.mold.ports import base_region
from finger3d.mold.regions import prisms, rectangle, section, widened

if TYPE_CHECKING:
    from manifold3d import CrossSection


def seal(bodies: Sequence[Triangles], layout: Layout, options: MoldOptions) -> Feature:
    """Return the tongues and grooves of a mold; nothing without a seal.

    Parameters
    ----------
    bodies : surface of every cavity, in place
    """
    if options.seal == "none":
        return Feature()
    width, depth = options.groove_mm
    bases = _union([base_region(body) for body in bodies])
    # The slice lies just beside the plane: a body may have a face on it.
    cut = _union([section(body, "z", layout.split + 1e-6 * float(body.size)) for body in bodies])
    middle = options.rim_mm + width / 2.0
    if options.seal == "cord":
        upright = prisms(_ring(cut, middle, width) ^ _above(layout, 0.0), "z", layout.split, depth)
        flat = prisms(_ring(bases, middle, width), "y", 0.0, depth)
        return Feature(cut={"half_a": [*upright, *flat], "half_b": flat})
    # With a carrier nothing may stand on it: it becomes the finger's base.
    lid = not options.carrier
    start = depth + options.rim_mm if lid else 0.0
    tongue = prisms(
        _ring(cut, middle, TONGUE_MM) ^ _above(layout, start + options.gap_mm), "z", layout.split, TONGUE_HEIGHT_MM
    )
    groove = prisms(_ring(cut, middle, width) ^ _above(layout, start), "z", layout.split, depth)
    if not lid:
        return Feature(add={"half_b": tongue}, cut={"half_a": groove})
    flat = prisms(_ring(bases, middle, width), "y", 0.0, depth)
    return Feature(
        add={"half_b": tongue, "lid": prisms(_ring(bases, middle, TONGUE_MM), "y", 0.0, TONGUE_HEIGHT_MM)},
        cut={"half_a": [*groove, *flat], "half_b": flat},
    )


def _ring(region: CrossSection, middle: float, width: float) -> CrossSection:
    """Return the points whose distance from a region differs from `middle` by at most half the width."""
    return widened(region, middle + width / 2.0) - widened(region, middle - width / 2.0)


def _above(layout: Layout, y: float) -> CrossSection:
    low, high = layout.outer_low, layout.outer_high
    return rectangle((float(low[0]), y), (float(high[0]), float(high[1])))


def _union(regions: Sequence[CrossSection]) -> CrossSection:
    from manifold3d import CrossSection, OpType

    return CrossSection.batch_boolean(list(regions), OpType.Add)
