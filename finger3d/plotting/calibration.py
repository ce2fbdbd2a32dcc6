"""calibration.png: calibration curve and fit, resolution, and contributions to the variance of mu."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d.plotting.layout import sheet, style
from finger3d.sensor.curve import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RESOLUTION_RANGE = 10.0  # upper end of the resolution axis, in multiples of the limit
_LEAST_SHARE = 0.005  # contributions to the variance below this share everywhere are left out
_SHARE_COLOURS = (
    "#2166ac",
    "#92c5de",
    "#b2182b",
    "#f4a582",
    "#5aae61",
    "#c2a5cf",
    "#762a83",
    "#e08214",
    "#8c510a",
    "#777777",
    "#bdbdbd",
)


def draw(path: Path, calibration: Calibration) -> None:
    """Draw strain, resolution and variance contributions against mu, and write them as a PNG file."""
    domain = calibration.about.get("domain", "")
    title = f"Gauge {calibration.name}" + (f", {domain}" if domain else "")
    made = sheet(1, 3, (5.4, 4.8), (0.8, 0.2, 1.2, 0.15), title)
    left, middle, right = made.axes
    curve_panel(left, calibration)
    _resolution(middle, calibration)
    _variance_shares(right, calibration)
    made.save(path)


def _finish(axes: Axes) -> None:
    style(axes)
    axes.set_xlabel("friction coefficient mu")


def _shade_ranges(axes: Axes, c: Calibration) -> None:
    """Shade the intervals of mu in which the gauge resolves mu within the limit."""
    for i, stretch in enumerate(c.trusted if c.tolerances else c.usable):
        axes.axvspan(stretch.low, stretch.high, color="#1b7837", alpha=0.10 if i == 0 else 0.05, lw=0)


def curve_panel(axes: Axes, c: Calibration) -> None:
    """Draw strain against mu: points, interpolation, second-order fit, and the standard deviation of a reading."""
    mu, sd = c.grid, c.reading_sd(c.grid)
    curve = c.at(mu)
    _shade_ranges(axes, c)
    axes.fill_between(mu, curve - sd, curve + sd, color="#2166ac", alpha=0.25, lw=0, label="±1 sd of a reading")
    axes.plot(mu, curve, color="#2166ac", lw=1.6, label="monotone interpolation")
    axes.plot(mu, c.at(mu, "fit"), "--", color="#b2182b", lw=1.3, label=f"second order, residual {c.fit.rms:.1e} rms")
    axes.plot(c.mu, c.reading, "o", ms=4, color="#222222", label="pressed")
    for i, (at, _) in enumerate(c.failed):
        axes.axvline(at, color="#888888", ls=":", lw=1.0, label="did not converge" if i == 0 else None)
    axes.set_ylabel("strain along the gauge")
    _finish(axes)
    axes.legend(frameon=False, fontsize=9, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)


def _resolution(axes: Axes, c: Calibration) -> None:
    mu = c.grid
    _shade_ranges(axes, c)
    whole = np.minimum(c.mu_sd(mu), 1e3)
    axes.semilogy(mu, whole, color="#222222", lw=1.3, label="with all tolerances")
    axes.semilogy(mu, np.minimum(c.resolution(mu), 1e3), color="#2166ac", lw=1.6, label=f"noise of {c.noise:g} alone")
    axes.semilogy(
        mu, np.minimum(c.resolution(mu, "fit"), 1e3), "--", color="#b2182b", lw=1.1, label="noise alone, by the fit"
    )
    axes.axhline(c.limit, color="#1b7837", lw=1.0, label=f"limit {c.limit:g}; shaded: kept")
    seen = c.resolution(mu)
    low = 0.5 * min(float(seen.min()), c.limit)
    axes.set_ylim(low, max(_RESOLUTION_RANGE * c.limit, 2.0 * float(np.median(np.minimum(whole, 1e3)))))
    axes.set_ylabel("standard deviation of mu")
    _finish(axes)
    axes.legend(frameon=False, fontsize=9, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)


def _variance_shares(axes: Axes, c: Calibration) -> None:
    """Draw the share of each source of uncertainty in the variance of mu, stacked to 1."""
    mu = c.grid
    rows = [np.full(len(mu), c.noise**2), c.curve_error(mu) ** 2, *c.tolerance_sd(mu) ** 2]
    names = [f"noise {c.noise:g}", "interpolation", *(f"{t.name} ± {t.sd:g}" for t in c.tolerances)]
    total = np.sum(rows, axis=0)
    keep = [i for i, row in enumerate(rows) if (row / total).max() >= _LEAST_SHARE]
    axes.stackplot(
        mu, [rows[i] / total for i in keep], labels=[names[i] for i in keep], colors=[_SHARE_COLOURS[i] for i in keep]
    )
    axes.set_ylim(0.0, 1.0)
    axes.set_xlim(float(mu[0]), float(mu[-1]))
    axes.set_ylabel("share of the variance of mu")
    _finish(axes)
    axes.legend(
        fontsize=9,
        loc="upper right",
        bbox_to_anchor=(1.02, -0.14),
        ncols=3,
        frameon=False,
        columnspacing=1.0,
        handlelength=1.4,
    )
