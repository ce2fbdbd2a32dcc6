"""The carrier: a printed plate in place of the lid, whose holes silicone fills and grips.

The holes are narrow at the sensor and wider outside, so that the silicone that fills them cannot be pulled out. They
are open outside: air leaves through them, and silicone stands in them. The carrier stays on the finger and becomes its
base: the solid with the label ``carrier`` beside the silicone, see :func:`finger_on_carrier`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.mold.options import MoldOptions
from finger3d.mold.ports import Ports
from finger3d.mold.regions import disc, inside, widened
from finger3d.mold.solids import cone, cylinder, one

if TYPE_CHECKING:
    from build123d import Solid
    from manifold3d import CrossSection

LABEL = "carrier"
"""Label of the carrier among the solids of a finger."""

HEAD = 1.7
"""Diameter of a hole outside over that at the sensor."""

_PITCH = 3.0  # least distance of two holes' middles over the diameter at the sensor
_LEAST_HOLES = 2
_INSIDE_MM = 0.05  # by which the outermost holes lie inside, more than outlines of regions are off


@dataclass(frozen=True)
class Keys:
    """Keyed holes of the carrier under one cavity.

    Attributes
    ----------
    places : (x, z) of the middles, mm
    neck_mm, head_mm : diameters at the sensor and outside
    """

    places: tuple[tuple[float, float], ...]
    neck_mm: float
    head_mm: float

    def volume_mm3(self, cover_mm: float) -> float:
        """Return the volume of the holes in a carrier of this thickness."""
        a, b = self.neck_mm / 2.0, self.head_mm / 2.0
        straight, slope = _heights(self, cover_mm)
        each = math.pi * (
            a * a * straight + slope / 3.0 * (a * a + a * b + b * b) + b * b * (cover_mm - straight - slope)
        )
        return len(self.places) * each


def _heights(keys: Keys, cover_mm: float) -> tuple[float, float]:
    """Return the heights of the neck and of the cone, which widens by 45 degrees where there is room."""
    slope = min(0.5 * (keys.head_mm - keys.neck_mm), 0.5 * cover_mm)
    return 0.4 * (cover_mm - slope), slope


def keys(base: CrossSection, ports: Ports, options: MoldOptions) -> Keys:
    """Return holes on a grid over the base, clear of its edge and of the pour hole.

    Raises
    ------
    Finger3dError
        If fewer than two holes fit on the base.
    """
    neck, head, rim = options.key_mm, HEAD * options.key_mm, options.rim_mm
    pitch = max(_PITCH * neck, head + 2.0 * rim)
    pour = ports.pour_mm + 2.0 * (ports.riser.wall_mm + options.gap_mm if ports.riser else 0.0)
    outside = max(pour, ports.funnel_mm if ports.riser is None else 2.0 * (ports.riser.radius_mm + rim))
    allowed = widened(base, -(neck / 2.0 + rim)) - disc(ports.pour, outside + head + 2.0 * rim)
    x0, z0, x1, z1 = base.bounds()
    ticks = [_ticks(low, high, pitch, neck + 2.0 * rim + 2.0 * _INSIDE_MM) for low, high in ((x0, x1), (z0, z1))]
    grid = np.array([(x, z) for x in ticks[0] for z in ticks[1]])
    places = grid[inside(allowed, grid)] if len(grid) and not allowed.is_empty() else grid[:0]
    if len(places) < _LEAST_HOLES:
        raise Finger3dError(
            f"--carrier --key-mm {neck:g}: {len(places)} keyed holes fit on the base, {x1 - x0:.4g} x {z1 - z0:.4g} "
            f"mm, must be {_LEAST_HOLES} or more; choose a smaller --key-mm, --pour-mm or --riser"
        )
    return Keys(tuple((round(float(x), 9), round(float(z), 9)) for x, z in places), neck, head)


def _ticks(low: float, high: float, pitch: float, margin: float) -> np.ndarray:
    """Return equally spaced coordinates between two ends, symmetric, at least a pitch apart."""
    room = high - low - margin
    if room < 0.0:
        return np.empty(0)
    count = int(room / pitch) + 1
    return 0.5 * (low + high) + (np.arange(count) - 0.5 * (count - 1)) * (room / max(count - 1, 1))


def key_solids(holes: Keys, x: float, options: MoldOptions) -> list[Solid]:
    """Return the holes of the cavity at `x` as solids through the carrier."""
    cover = options.carrier_mm
    straight, slope = _heights(holes, cover)
    solids = []
    for kx, kz in holes.places:
        middle = kx + x
        solids += [
            cylinder((middle, -straight, kz), holes.neck_mm, straight, "y"),
            cone((middle, -straight - slope, kz), holes.head_mm, holes.neck_mm, slope, "y"),
            cylinder((middle, -cover, kz), holes.head_mm, cover - straight - slope, "y"),
        ]
    return solids


def finger_on_carrier(solid: Solid, carrier: Solid, rods: Sequence[Solid], cover_mm: float) -> Mapping[str, Solid]:
    """Return the solids of a finger on its carrier by their labels, the carrier's outer face on y = 0.

    Parameters
    ----------
    solid : the finger, base on y = 0
    carrier : the carrier below y = 0
    rods : the silicone in its holes; filled to the outer face
    cover_mm : thickness of the carrier

    Returns
    -------
    Mapping
        The silicone with the label "" and the carrier with the label "carrier".
    """
    from build123d import Pos

    silicone = solid.fuse(*rods) if rods else solid
    lifted = Pos(0, float(cover_mm), 0)
    return {
        "": one(lifted * silicone, "the finger on its carrier"),
        LABEL: one(lifted * carrier, LABEL),
    }
