"""calibration.png: readings over mu, the standard deviation of mu, and what would reduce its variance."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from finger3d.plotting.layout import finish, sheet
from finger3d.sensor.calibration import Calibration
from finger3d.sensor.curve import QUANTITIES, ReadingCurve

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
    axes.plot(mu, c.fit.at(mu), "--", color="#b2182b", lw=1.3, label=f"second order, residual {c.fit.rms:.1e} rms")
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
