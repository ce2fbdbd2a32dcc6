"""Pictures of optimisations: the search for a shape, design.png, and the places of several gauges, map.png."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float
from finger3d.geometry.design import Design
from finger3d.plotting.layout import finish, sheet
from finger3d.plotting.panels import middle_section

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_MOST_KEYS = 5  # free keys with a panel
_ROWS = 2  # of panels, at most
_JUDGED, _BEST, _START = "#9db7d5", "#c0392b", "#222222"


def draw(
    path: Path,
    keys: Sequence[str],
    places: Sequence[Sequence[float]],
    values: Sequence[float],
    start: Sequence[float],
    objective: str,
) -> None:
    """Draw the designs with a finite objective and write the picture.

    Parameters
    ----------
    path : PNG file to write
    keys : names of the k free keys
    places : (n, k) values of the free keys of every design, in order of evaluation
    values : (n,) objective of every design; NaN if its solution failed
    start : (k,) values of the free keys of the initial design
    objective : label of the objective
    """
    good = np.isfinite(values)
    at, value = np.array(places, dtype=float)[good], np.array(values, dtype=float)[good]
    best, shown = int(np.argmax(value)), list(keys[:_MOST_KEYS])
    made = sheet(1 + len(shown), math.ceil((1 + len(shown)) / _ROWS), (5.4, 3.9), (0.95, 0.2, 0.6, 0.45))
    first, *others = made.axes
    count = 1 + np.flatnonzero(good)
    first.plot(count, value, "o", ms=3, color=_JUDGED, label="each design")
    first.step(count, np.maximum.accumulate(value), where="post", color=_BEST, lw=1.5, label="best so far")
    first.set_xlabel("designs judged")
    for column, (key, axes) in enumerate(zip(shown, others, strict=False)):
        axes.plot(at[:, column], value, "o", ms=3, color=_JUDGED, label="each design")
        begin = np.flatnonzero(np.all(at == np.array(start), axis=1))[:1]
        axes.plot(at[begin, column], value[begin], "s", ms=6, mfc="none", color=_START, label="start")
        axes.plot(at[best, column], value[best], "*", ms=11, color=_BEST, label="best")
        axes.set_xlabel(key)
    for axes in made.axes:
        finish(axes, y=objective, fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    made.save(path)


_COLUMNS = 3  # panels beside each other
_LINE = 4.0  # length of the line that shows a direction, in percent of the width of the section
_HIGHEST = 0.95  # share of the places within the colour scale
_CHOSEN, _OTHER = "#c0392b", "#222222"


@dataclass(frozen=True)
class GaugeMap:
    """A gauge at x, y (mm) and an angle (rad), and the standard deviation of mu if it is moved elsewhere.

    Attributes
    ----------
    mu_sd_alone : (m,) standard deviation of mu by this gauge alone
    places, mean_mu_sd : (c, 3) mm and (c,) mean standard deviation of mu with the gauge there, in the best direction
    """

    x: float
    y: float
    angle: float
    mu_sd_alone: Float
    places: Float
    mean_mu_sd: Float


def draw_places(path: Path, mus: Sequence[float], mu_sd: Float, maps: Sequence[GaugeMap], design: Design) -> None:
    """Draw a map for each gauge, and the standard deviation (m,) of mu; write a PNG file."""
    count = len(maps)
    columns = 2 if count in (1, 3) else _COLUMNS
    made = sheet(count + 1, columns, (5.6, 4.6), (0.75, 0.25, 0.6, 0.5))
    every = np.concatenate([one.mean_mu_sd[np.isfinite(one.mean_mu_sd)] for one in maps])
    low, high = float(every.min()), float(np.quantile(every, _HIGHEST))
    for i, (one, axes) in enumerate(zip(maps, made.axes, strict=False)):
        drawn = axes.scatter(
            one.places[:, 0],
            one.places[:, 1],
            c=one.mean_mu_sd,
            s=14,
            marker="s",
            cmap="viridis_r",
            vmin=low,
            vmax=max(high, 1.001 * low),
        )
        label = "mean standard deviation of mu"
        made.figure.colorbar(drawn, ax=axes, label=label, location="bottom", shrink=0.8, aspect=35)
        axes.plot(*middle_section(design).T, color="#555555", lw=1.0)
        for k, gauge in enumerate(maps):
            _mark(axes, gauge, f"g{k + 1}", _CHOSEN if k == i else _OTHER, design)
        axes.set_title(f"g{i + 1} at each place" + (", beside the others" if count > 1 else ""))
        axes.set_xlabel("x (mm)")
        axes.set_ylabel("y (mm)")
        axes.set_aspect("equal")
    last = made.axes[count]
    for i, one in enumerate(maps):
        last.semilogy(mus, one.mu_sd_alone, "o-", ms=3, lw=1.0, label=f"g{i + 1} alone")
    if count > 1:
        last.semilogy(mus, mu_sd, "o-", ms=4, lw=2.0, color=_OTHER, label="together")
    finish(last, "friction coefficient mu", "standard deviation of mu", fontsize=9)
    made.save(path)


def _mark(axes: Axes, gauge: GaugeMap, name: str, colour: str, design: Design) -> None:
    """Draw a gauge as a line along its direction, with its name."""
    half = 0.02 * _LINE * design.half_length_mm
    x, y = half * math.cos(gauge.angle), half * math.sin(gauge.angle)
    axes.plot([gauge.x - x, gauge.x + x], [gauge.y - y, gauge.y + y], color=colour, lw=2.0)
    axes.annotate(name, (gauge.x, gauge.y), xytext=(6, 6), textcoords="offset points", color=colour)
