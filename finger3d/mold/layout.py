"""Places of the cavity, the walls and the pegs of a mold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.mold.options import PEG_MM, WALL_MM, MoldOptions


@dataclass(frozen=True)
class Layout:
    """Places in the axes of the mold, mm.

    Attributes
    ----------
    low, high : corners (3,) of the box around the cavity
    outer_low, outer_high : corners (3,) of the box of both halves, which begins at y = 0
    split : z at which the halves meet
    rows : y of the pegs between the halves
    """

    low: Float
    high: Float
    outer_low: Float
    outer_high: Float
    split: float
    rows: tuple[float, ...]

    @property
    def top(self) -> float:
        """Height of the halves, y."""
        return float(self.outer_high[1])


def layout_of(low: Float, high: Float, options: MoldOptions) -> Layout:
    """Place the walls around the cavity, and rows of pegs clear of the pegs of the lid.

    Parameters
    ----------
    low, high : corners (3,) of the box around the cavity, mm
    """
    away = options.peg_distance_mm
    around = options.peg_hole_mm / 2.0 + options.rim_mm
    near = PEG_MM + options.gap_mm + around
    far = max(float(high[1]) + away, near)
    rows = (near, far) if far - near >= 2.0 * around else (far,)
    return Layout(
        low=low,
        high=high,
        outer_low=np.array([low[0] - WALL_MM, 0.0, low[2] - WALL_MM]),
        outer_high=np.array([high[0] + WALL_MM, max(float(high[1]) + WALL_MM, far + around), high[2] + WALL_MM]),
        split=options.split_mm * options.scale,
        rows=rows,
    )
