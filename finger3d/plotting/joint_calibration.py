"""calibration.png of several readings: their curves, the standard deviation of mu, and reductions of its variance."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d.plotting.layout import sheet, style
from finger3d.sensor.curve import Calibration
from finger3d.sensor.joint import JointCalibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HIGHEST_SD = 100.0  # upper end of the axis of the standard deviation of mu, in multiples of its least
_LEAST_SHARE = 0.01  # reductions of the variance below this everywhere are left out
_MANY = 8  # readings beyond which the legend names the first only


def draw_joint(path: Path, calibration: JointCalibration) -> None:
    """Draw readings, standard deviation of mu, and reductions of its variance against mu; write a PNG file."""
    domain = calibration.about.get("domain", "")
    title = f"{len(calibration.readings)} readings together" + (f", {domain}" if domain else "")
    made = sheet(1, 3, (5.8, 5.2), (0.8, 0.2, 1.6, 0.15), title)
    left, middle, right = made.axes
    _curves(left, calibration)
    _mu_sd(middle, calibration)
    _reductions(right, calibration)
    made.save(path)


def _finish(axes: Axes) -> None:
    style(axes)
    axes.set_xlabel("friction coefficient mu")
    axes.legend(frameon=False, fontsize=9, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, columnspacing=1.0)


def _label(calibration: Calibration, number: int) -> str | None:
    return calibration.name if number < _MANY else None


def _curves(axes: Axes, c: JointCalibration) -> None:
    """Draw every reading over the standard deviation of its error, from its value at the least mu."""
    for i, one in enumerate(c.readings):
        sd = float(np.median(one.reading_sd(one.mu)))
        begin = float(one.at(one.mu[0]))
        (line,) = axes.plot(c.grid, (one.at(c.grid) - begin) / sd, lw=1.5, label=_label(one, i))
        axes.plot(one.mu, (one.reading - begin) / sd, "o", ms=3, color=line.get_color())
    axes.set_ylabel("change of a reading over its standard deviation")
    _finish(axes)


def _mu_sd(axes: Axes, c: JointCalibration) -> None:
    for low, high in c.trusted:
        axes.axvspan(low, high, color="#1b7837", alpha=0.08, lw=0)
    together = c.mu_sd(c.grid)
    top = _HIGHEST_SD * float(together.min())
    for i, one in enumerate(c.readings):
        label = f"{one.name} alone" if i < _MANY else None
        axes.semilogy(c.grid, np.minimum(one.mu_sd(c.grid), 10.0 * top), lw=1.0, label=label)
    axes.semilogy(c.grid, np.minimum(together, 10.0 * top), color="#222222", lw=2.0, label="all together")
    noise = np.minimum(c.mu_sd(c.grid, tolerances=False), 10.0 * top)
    axes.semilogy(c.grid, noise, "--", color="#222222", lw=1.0, label="all, noise alone")
    axes.axhline(c.limit, color="#1b7837", lw=1.0, label=f"limit {c.limit:g}; shaded: kept")
    axes.set_ylim(0.5 * float(noise.min()), max(top, 2.0 * c.limit))
    axes.set_ylabel("standard deviation of mu")
    _finish(axes)


def _reductions(axes: Axes, c: JointCalibration) -> None:
    sds = {t.name: f" ± {t.sd:g}" for one in c.readings for t in one.tolerances}
    for name, share in c.reductions(c.grid).items():
        if share.max() >= _LEAST_SHARE:
            axes.plot(c.grid, share, lw=1.4, label=f"{name}{sds.get(name, '')}")
    axes.set_ylim(0.0, 1.0)
    axes.set_ylabel("fall of the variance of mu if known exactly")
    _finish(axes)
