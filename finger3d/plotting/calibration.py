"""Pictures of a calibration, calibration.png and map.png.

The first shows readings over mu, the standard deviation of mu, and what would reduce its variance; the second the
sensitivity of strain to friction over the section, and the best direction of a gauge.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.plotting.layout import finish, sheet
from finger3d.sensor.calibration import Calibration
from finger3d.sensor.curve import QUANTITIES, ReadingCurve
from finger3d.sensor.maps import StrainMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure


_LEAST_SHARE = 0.01  # reductions of the variance below this everywhere are left out
_MANY = 8  # readings beyond which the legend names the first only


def draw(path: Path, calibration: Calibration) -> None:
    """Draw readings, standard deviation of mu, and reductions of its variance against mu; write a PNG file."""
    domain = calibration.about.get("domain", "")
    title = calibration.title if len(calibration.readings) <= _MANY else f"{len(calibration.readings)} readings"
    made = sheet(3, 3, (5.6, 5.0), (0.8, 0.2, 1.5, 0.15), title + (f", {domain}" if domain else ""))
    left, middle, right = made.axes
    if len(calibration.readings) == 1:
        curve_panel(left, calibration)
    else:
        _changes(left, calibration)
    _mu_sd(middle, calibration)
    _reductions(right, calibration)
    made.save(path)


def _finish(axes: Axes) -> None:
    below: dict[str, Any] = {
        "fontsize": 9,
        "loc": "upper center",
        "bbox_to_anchor": (0.5, -0.13),
        "ncols": 2,
        "columnspacing": 1.0,
    }
    finish(axes, "friction coefficient mu", **(below if axes.get_legend_handles_labels()[0] else {}))


def _shade_trusted(axes: Axes, c: Calibration) -> None:
    """Shade the intervals of mu in which estimates are within the limit."""
    for i, (low, high) in enumerate(c.trusted):
        label = f"mu found within {c.limit:g}" if i == 0 else None
        axes.axvspan(low, high, color="#1b7837", alpha=0.10, lw=0, label=label)


def curve_panel(axes: Axes, calibration: Calibration) -> None:
    """Draw a single reading against mu: points, interpolation, second-order fit, and its standard deviation."""
    c: ReadingCurve = calibration.readings[0]
    mu, sd, curve = c.grid, c.reading_sd(c.grid), c.at(c.grid)
    _shade_trusted(axes, calibration)
    axes.fill_between(mu, curve - sd, curve + sd, color="#2166ac", alpha=0.25, lw=0, label="±1 sd of a reading")
    axes.plot(mu, curve, color="#2166ac", lw=1.6, label="monotone interpolation")
    axes.plot(mu, c.at(mu, "fit"), "--", color="#b2182b", lw=1.3, label=f"second order, residual {c.fit.rms:.1e} rms")
    axes.plot(c.mu, c.reading, "o", ms=4, color="#222222", label="pressed")
    for i, (at, _) in enumerate(calibration.failed):
        axes.axvline(at, color="#888888", ls=":", lw=1.0, label="did not converge" if i == 0 else None)
    quantity, unit = QUANTITIES[c.kind]
    axes.set_ylabel(f"{quantity} of {c.name}" + (f" ({unit})" if unit != "1" else ""))
    _finish(axes)


def _changes(axes: Axes, c: Calibration) -> None:
    """Draw every reading over the standard deviation of its error, from its value at the least mu."""
    for i, one in enumerate(c.readings):
        sd = float(np.median(one.reading_sd(one.mu)))
        begin = float(one.at(one.mu[0]))
        label = one.name if i < _MANY else None
        (line,) = axes.plot(c.grid, (one.at(c.grid) - begin) / sd, lw=1.5, label=label)
        axes.plot(one.mu, (one.reading - begin) / sd, "o", ms=3, color=line.get_color())
    axes.set_ylabel("change of a reading over its standard deviation")
    _finish(axes)


def _mu_sd(axes: Axes, c: Calibration) -> None:
    """Draw the standard deviations of estimates of mu: of each reading, of all, and with the noise alone."""
    _shade_trusted(axes, c)
    if len(c.readings) > 1:
        for name in c.names[:_MANY]:
            axes.semilogy(c.judged_mu, [e.std for e in c.of([name]).judged], lw=1.0, label=f"{name} alone")
    axes.semilogy(c.judged_mu, [e.std for e in c.judged], color="#222222", lw=2.0, label="with all tolerances")
    axes.semilogy(c.judged_mu, [e.std for e in c.judged_by_noise], "--", color="#222222", lw=1.0, label="noise alone")
    axes.axhline(c.limit, color="#1b7837", lw=1.0, label=f"limit {c.limit:g}")
    known = [e.std for e in (*c.judged, *c.judged_by_noise) if e.is_determined]
    axes.set_autoscale_on(False)  # which warns where there is nothing but the limit
    axes.set_ylim(0.5 * min([*known, c.limit]), 2.0 * max([*known, c.limit]))
    axes.set_xlim(float(c.mu[0]), float(c.mu[-1]))
    axes.set_ylabel("standard deviation of mu")
    _finish(axes)


def _reductions(axes: Axes, c: Calibration) -> None:
    sds = {
        t.name: f" ± {t.sd:g}" + (" error bar" if t.unit == "error bar" else "")
        for one in c.readings
        for t in one.tolerances
    }
    for name, share in c.reductions(c.grid).items():
        if share.max() >= _LEAST_SHARE:
            axes.plot(c.grid, share, lw=1.4, label=f"{name}{sds.get(name, '')}")
    axes.set_ylim(0.0, 1.0)
    axes.set_ylabel("fall of the variance of mu if known exactly")
    _finish(axes)


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
