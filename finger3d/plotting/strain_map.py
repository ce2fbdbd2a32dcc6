"""map.png: sensitivity of strain to friction over the section, and the best direction of a gauge."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.plotting.layout import sheet
from finger3d.sensor.calibration import Calibration
from finger3d.sensor.maps import StrainMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure


_WORST_RESOLUTION = 10.0  # upper end of the colour scale, in multiples of the limit; grey beyond
_BEST_RESOLUTION = 0.05  # lower end of the colour scale, in multiples of the limit
_QUANTILE = 0.99  # share of the squares within the colour scale of the slope
_SMALLEST_SLOPE = 1e-12  # strain per unit of mu; avoids a division by zero


def draw_map(path: Path, found: StrainMap, gauge: Gauge, calibration: Calibration, mu: float = 0.5) -> None:
    """Draw the slope of strain against mu, and the worst resolution of mu along the gauge and along the best direction.

    Parameters
    ----------
    path : PNG file to write
    found : slopes over the section
    gauge : gauge, whose direction is used and whose position is marked
    calibration : calibration of the gauge, for its noise and its limit of resolution
    mu : coefficient of friction of the first panel, limited to the range of the map
    """
    ends = f"mu = {found.mu[0]:g} to {found.mu[-1]:g}"
    title = f"z = {found.z_mm:g} mm, {ends}, noise {float(calibration.noise[0]):g}; circle: gauge {gauge.name}"
    made = sheet(3, 3, (5.4, 3.9), (0.7, 0.15, 0.2, 0.35), title)
    figure, panels = made.figure, made.axes
    mu = float(np.clip(mu, found.mu[0], found.mu[-1]))
    degrees = math.degrees(gauge.angle)
    slope_panel(figure, panels[0], found, gauge.angle, mu)
    panels[0].set_title(f"d strain / d mu along {degrees:.4g}° at mu = {mu:.3g}")
    noise = float(calibration.noise[0])
    resolution_panel(figure, panels[1], found, noise / _positive(found.worst_slope(gauge.angle)), calibration.limit)
    panels[1].set_title(f"worst resolution along {degrees:.4g}°")
    best, direction = found.best()
    resolution_panel(figure, panels[2], found, noise / _positive(best), calibration.limit)
    panels[2].set_title("worst resolution along the best direction")
    _directions(panels[2], found, noise / _positive(best) <= _WORST_RESOLUTION * calibration.limit, direction)
    for axes in panels:
        axes.plot(gauge.x_mm, gauge.y_mm, "o", ms=8, mfc="none", mec="#000000", mew=1.4)
        axes.set_xlabel("x (mm)")
        axes.set_ylabel("y (mm)")
    made.save(path)


def _positive(slope: Float) -> Float:
    return np.maximum(slope, _SMALLEST_SLOPE)


def _edges(at: Float) -> Float:
    """Return the n + 1 edges of the squares around n equidistant positions."""
    half = 0.5 * (at[1] - at[0])
    return np.append(at - half, at[-1] + half)


def _colour_bar(figure: Figure, axes: Axes, drawn: ScalarMappable, label: str, extend: str) -> None:
    figure.colorbar(drawn, ax=axes, label=label, extend=extend, location="bottom", shrink=0.8, aspect=35)


def slope_panel(figure: Figure, axes: Axes, found: StrainMap, angle: float, mu: float) -> None:
    """Draw the slope of strain against mu, per unit of mu, along a direction `angle`, in rad, at one mu."""
    value = found.slope_at(angle, mu)
    most = float(np.nanquantile(np.abs(value), _QUANTILE)) or 1.0
    drawn = axes.pcolormesh(_edges(found.x), _edges(found.y), value, cmap="RdBu_r", vmin=-most, vmax=most)
    axes.set_aspect("equal")
    _colour_bar(figure, axes, drawn, "strain per unit of mu", "both")


def resolution_panel(figure: Figure, axes: Axes, found: StrainMap, value: Float, limit: float) -> None:
    """Draw a resolution of mu, shape (ny, nx), on a logarithmic scale; grey beyond ten times the limit."""
    from matplotlib.colors import LogNorm

    norm = LogNorm(_BEST_RESOLUTION * limit, _WORST_RESOLUTION * limit)
    shown = np.ma.masked_invalid(value)
    axes.pcolormesh(
        _edges(found.x), _edges(found.y), np.where(np.isnan(value), np.nan, 1.0), cmap="Greys", vmin=0, vmax=4
    )
    drawn = axes.pcolormesh(
        _edges(found.x),
        _edges(found.y),
        np.ma.masked_greater(shown, _WORST_RESOLUTION * limit),
        cmap="viridis_r",
        norm=norm,
    )
    axes.set_aspect("equal")
    _colour_bar(figure, axes, drawn, "standard deviation of mu", "min")


def _directions(axes: Axes, found: StrainMap, shown: NDArray[np.bool_], direction: Float, every: int = 4) -> None:
    """Draw short lines along the best direction, (ny, nx) rad, at the squares that are `shown`, (ny, nx)."""
    rows, columns = (slice(every // 2, None, every) for _ in range(2))
    x, y = np.meshgrid(found.x[columns], found.y[rows])
    turn, seen = direction[rows, columns], shown[rows, columns]
    axes.quiver(
        x[seen],
        y[seen],
        np.cos(turn[seen]),
        np.sin(turn[seen]),
        pivot="mid",
        headwidth=0,
        headlength=0,
        headaxislength=0,
        scale=40.0,
        width=0.002,
        color="#222222",
    )
