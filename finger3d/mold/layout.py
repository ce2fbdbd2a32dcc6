"""Places of cavities, walls and pegs of a mold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.mold.options import MoldOptions


@dataclass(frozen=True)
class Layout:
    """Places in the axes of the mold, mm.

    Attributes
    ----------
    low, high : corners (3,) of the box around all cavities
    outer_low, outer_high : corners (3,) of the box of both halves, which begins at y = 0
    split : z at which the halves meet
    places : x of the middle of each cavity
    rows : y of the pegs between the halves
    """

    low: Float
    high: Float
    outer_low: Float
    outer_high: Float
    split: float
    places: tuple[float, ...]
    rows: tuple[float, ...]

    @property
    def top(self) -> float:
        """Height of the halves, y."""
        return float(self.outer_high[1])


def layout_of(low: Float, high: Float, options: MoldOptions) -> Layout:
    """Place the cavities in a row along x, the walls around them, and rows of pegs clear of the pegs of the lid.

    Parameters
    ----------
    low, high : corners (3,) of the box around one cavity, mm
    """
    between = max(2.0 * options.seal_reach_mm + options.rim_mm, 3.0 * options.rim_mm)
    pitch = float(high[0] - low[0]) + between
    places = tuple(pitch * (i - 0.5 * (options.cavities - 1)) for i in range(options.cavities))
    first, last = low + [places[0], 0.0, 0.0], high + [places[-1], 0.0, 0.0]
    wall, away = options.around_mm + options.band_depth_mm, options.peg_distance_mm
    around = options.peg_hole_mm / 2.0 + options.rim_mm
    near = options.hole_depth_mm + around
    far = max(float(high[1]) + away, near)
    rows = (near, far) if far - near >= 2.0 * around else (far,)
    top = max(float(high[1]) + wall, far + around + options.band_depth_mm)
    return Layout(
        low=first,
        high=last,
        outer_low=np.array([first[0] - wall, 0.0, first[2] - wall]),
        outer_high=np.array([last[0] + wall, top, last[2] + wall]),
        split=options.split_mm * options.scale,
        places=places,
        rows=rows,
    )
