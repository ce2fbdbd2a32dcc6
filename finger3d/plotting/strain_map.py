"""map.png: where, and which way, a gauge follows friction."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d.mechanics.model import Gauge
from finger3d.plotting.layout import sheet
from finger3d.sensor.curve import Calibration
from finger3d.sensor.maps import StrainMap

Float = NDArray[np.float64]

_GREY = 10.0  # limits: where mu is resolved worse than that, nothing is drawn

_BELOW: dict[str, Any] = {"location": "bottom", "shrink": 0.8, "aspect": 35}


def draw_map(path: Path, found: StrainMap, gauge: Gauge, calibration: Calibration, mu: float = 0.5) -> None:
    """Draw slope along the gauge at one mu, the worst resolution over all mu along it, and along the best direction."""
    ends = f"mu = {found.mu[0]:g} to {found.mu[-1]:g}"
    title = f"z = {found.z_mm:g} mm, {ends}, noise {calibration.noise:g}; circle: gauge {gauge.name}"
    made = sheet(1, 3, (5.4, 3.9), (0.7, 0.15, 0.2, 0.35), title)
    figure, panels = made.figure, made.axes
    mu = float(np.clip(mu, found.mu[0], found.mu[-1]))
    degrees = math.degrees(gauge.angle)
    slope_panel(figure, panels[0], found, gauge.angle, mu)
    panels[0].set_title(f"d strain / d mu along {degrees:.4g}° at mu = {mu:.3g}")
    noise = calibration.noise
    resolution_panel(figure, panels[1], found, noise / _positive(found.worst_slope(gauge.angle)), calibration.limit)
    panels[1].set_title(f"worst resolution along {degrees:.4g}°")
    best, direction = found.best()
    resolution_panel(figure, panels[2], found, noise / _positive(best), calibration.limit)
    panels[2].set_title("worst resolution along the best direction")
    _directions(panels[2], found, noise / _positive(best) <= _GREY * calibration.limit, direction)
    for axes in panels:
        axes.plot(gauge.x_mm, gauge.y_mm, "o", ms=8, mfc="none", mec="#000000", mew=1.4)
        axes.set_xlabel("x (mm)")
        axes.set_ylabel("y (mm)")
    made.save(path)


def _positive(slope: Float) -> Float:
    return np.maximum(slope, 1e-12)


def _edges(at: Float) -> Float:
    half = 0.5 * (at[1] - at[0])
    return np.append(at - half, at[-1] + half)


def slope_panel(figure: Any, axes: Any, found: StrainMap, angle: float, mu: float) -> None:
    """Signed slope; the colours end where 1 % of the squares lie beyond."""
    value = found.slope_at(angle, mu)
    most = float(np.nanquantile(np.abs(value), 0.99)) or 1.0
    drawn = axes.pcolormesh(_edges(found.x), _edges(found.y), value, cmap="RdBu_r", vmin=-most, vmax=most)
    axes.set_aspect("equal")
    figure.colorbar(drawn, ax=axes, label="strain per unit of mu", extend="both", **_BELOW)


def resolution_panel(figure: Any, axes: Any, found: StrainMap, value: Float, limit: float) -> None:
    """Resolution on a logarithmic scale about the limit; what is worse than ten limits is grey."""
    from matplotlib.colors import LogNorm

    norm = LogNorm(0.05 * limit, _GREY * limit)
    shown = np.ma.masked_invalid(value)
    axes.pcolormesh(
        _edges(found.x), _edges(found.y), np.where(np.isnan(value), np.nan, 1.0), cmap="Greys", vmin=0, vmax=4
    )
    drawn = axes.pcolormesh(
        _edges(found.x), _edges(found.y), np.ma.masked_greater(shown, _GREY * limit), cmap="viridis_r", norm=norm
    )
    axes.set_aspect("equal")
    figure.colorbar(drawn, ax=axes, label="standard deviation of mu", extend="min", **_BELOW)


def _directions(axes: Any, found: StrainMap, told: NDArray[np.bool_], direction: Float, every: int = 4) -> None:
    """Short lines along the best direction, where it tells anything."""
    rows, columns = (slice(every // 2, None, every) for _ in range(2))
    x, y = np.meshgrid(found.x[columns], found.y[rows])
    turn, seen = direction[rows, columns], told[rows, columns]
    axes.quiver(
        x[seen], y[seen], np.cos(turn[seen]), np.sin(turn[seen]), pivot="mid", headwidth=0, headlength=0,
        headaxislength=0, scale=40.0, width=0.002, color="#222222",
    )  # fmt: skip
