"""markers.png: displacements of the markers, as a camera behind the object sees them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from finger3d.plotting.layout import finish, sheet

_MAGNIFIED = (1.0, 2.0, 5.0)  # times a power of ten
_LONGEST = 0.12  # of an arrow, over the extent of the markers
_WIDTH, _LEAST_HEIGHT = 8.4, 2.9  # inches
_MARGINS = (0.9, 1.4, 0.6, 0.45)
_COLOURS = "viridis"


def draw(path: Path, table: Mapping[str, ArrayLike]) -> None:
    """Draw the displacements after the last increment as magnified arrows; the colour is that along y.

    Markers of a solid are seen along the press axis, those of a section along z.

    Parameters
    ----------
    path : PNG file to write
    table : columns of markers.csv
    """
    step = np.asarray(table["step"])
    last = step == step.max()
    x, y, z = (np.asarray(table[f"{axis}_mm"], dtype=float)[last] for axis in "xyz")
    along = {axis: np.asarray(table[f"displacement_{axis}_mm"], dtype=float)[last] for axis in "xyz"}
    solid = bool(np.any(z != 0.0) or np.any(along["z"] != 0.0))
    across, moved, name = (z, along["z"], "z") if solid else (y, along["y"], "y")
    extent = max(float(np.ptp(x)), float(np.ptp(across)), 1.0)
    longest = float(np.hypot(along["x"], moved).max())
    factor = _round(_LONGEST * extent / longest) if longest > 0.0 else 1.0
    left, right, below, above = _MARGINS
    pad = 0.08 * extent
    shape = (float(np.ptp(across)) + 2.0 * pad) / (float(np.ptp(x)) + 2.0 * pad)
    height = max(_LEAST_HEIGHT, (_WIDTH - left - right) * shape + below + above)
    made = sheet(1, 1, (_WIDTH, height), _MARGINS)
    (axes,) = made.axes
    arrows = axes.quiver(
        x, across, factor * along["x"], factor * moved, along["y"], cmap=_COLOURS, angles="xy", scale_units="xy",
        scale=1.0, width=0.0025, zorder=3,
    )  # fmt: skip
    axes.plot(x, across, "o", ms=2.0, color="#777777", zorder=2)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)
    depth = float(np.asarray(table["depth_mm"], dtype=float)[last][0])
    axes.set_title(f"markers at {depth:.4g} mm, displacements drawn {factor:g} times", fontsize=11)
    finish(axes, "x (mm)", f"{name} (mm)")
    bar = made.figure.colorbar(arrows, ax=axes, fraction=0.04, pad=0.02)
    bar.set_label("displacement along y (mm)")
    made.save(path)


def _round(value: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(f * power for f in _MAGNIFIED if f * power <= value * (1.0 + 1e-9)))
