"""Figures of the analyses: calibration, comparison, cost, identification, optimisation and sensitivity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from finger3d._types import Float, Tree
from finger3d.geometry.design import Design
from finger3d.plotting.layout import WIDEST, finish, sheet
from finger3d.plotting.panels import middle_section
from finger3d.results.summary import FORCE, SHOWN, Case
from finger3d.sensor.calibration import Calibration
from finger3d.sensor.curve import QUANTITIES, ReadingCurve

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_LEAST_SHARE = 0.01  # reductions of the variance below this everywhere are left out
_MANY = 8  # readings beyond which the legend names the first only


def draw_calibration(path: Path, calibration: Calibration) -> None:
    """Draw readings, standard deviation of mu, and reductions of its variance against mu; write a PNG file."""
    domain = calibration.about.get("domain", "")
    title = calibration.title if len(calibration.readings) <= _MANY else f"{len(calibration.readings)} readings"
    made = sheet(3, 3, (5.6, 5.0), (0.8, 0.2, 1.5, 0.15), title + (f", {domain}" if domain else ""))
    left, middle, right = made.axes
    (curve_panel if len(calibration.readings) == 1 else _changes)(left, calibration)
    _mu_sd(middle, calibration)
    _reductions(right, calibration)
    made.save(path)


def _finish(axes: Axes) -> None:
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.13), "ncols": 2, "columnspacing": 1.0}
    has_legend = bool(axes.get_legend_handles_labels()[0])
    finish(axes, "friction coefficient mu", **({"fontsize": 9, **place} if has_legend else {}))


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


_COLOURS = {"plane strain": "#b2182b", "plane stress": "#2166ac", "solid": "#222222"}
_MOST_QUANTITIES = 9  # groups of bars


def draw_comparison(path: Path, cases: Sequence[Case], own_width_mm: float, title: str) -> None:
    """Draw the converged cases and write the picture.

    Parameters
    ----------
    path : PNG file to write
    cases : models of one scene, at several widths
    own_width_mm : width of the scene
    title : title of the scene
    """
    good = [c for c in cases if c.ok]
    own = [c for c in good if c.width_mm == own_width_mm]
    made = sheet(4, 2, (WIDEST, 4.2), (0.95, 0.15, 0.7, 0.2), f"{title}: 2D against 3D")
    forces, bars, pressure, shear = made.axes
    _forces(forces, good, own)
    _bars(bars, own)
    _along(pressure, own, "pressure_MPa", "pressure (MPa)")
    _along(shear, own, "shear_x_MPa", "shear along x on the finger (MPa)")
    made.save(path)


def _forces(axes: Axes, cases: Sequence[Case], own: Sequence[Case]) -> None:
    """Draw the force per width of solids against their width, with the plane models as horizontal lines."""
    from matplotlib.ticker import NullFormatter

    solids = sorted((c for c in cases if c.model == "solid"), key=lambda c: c.width_mm)
    for case in own:
        if case.model != "solid":
            value, error = case.numbers[FORCE], case.errors.get(FORCE, 0.0)
            axes.axhspan(value - error, value + error, color=_COLOURS[case.model], alpha=0.15, lw=0)
            axes.axhline(value, color=_COLOURS[case.model], ls="--", lw=1.2, label=case.model)
    width, force = [c.width_mm for c in solids], [c.numbers[FORCE] for c in solids]
    bars = [c.errors.get(FORCE, 0.0) for c in solids]
    axes.errorbar(width, force, bars, fmt="o-", ms=5, lw=1.3, capsize=3, color=_COLOURS["solid"], label="solid")
    if len(width) > 1:
        axes.set_xscale("log")
        axes.set_xticks(width, [f"{w:g}" for w in width])
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.tick_params(axis="x", which="minor", length=0)
    axes.set_ylim(bottom=0.0)
    finish(axes, "width (mm)", "force per width (N/mm)", loc="lower right")


def _bars(axes: Axes, own: Sequence[Case]) -> None:
    """Draw the quantities of each model as bars, relative to those of the solid."""
    solid = next((c for c in own if c.model == "solid"), None)
    if solid is None:
        axes.set_axis_off()
        return
    names = {one.name: fill(one.title, 11) for one in SHOWN} | {
        column.key: f"gauge\n{column.sensor}" for column in solid.strains
    }
    keys = [k for k in names if solid.numbers.get(k)][:_MOST_QUANTITIES]
    at, step = np.arange(len(keys)), 0.8 / len(own)
    for i, case in enumerate(own):
        scale = np.array([solid.numbers[k] for k in keys])
        value = np.array([case.numbers[k] for k in keys]) / scale
        error = np.array([case.errors.get(k, 0.0) for k in keys]) / np.abs(scale)
        beside, colour, thin = at + (i - 0.5 * (len(own) - 1)) * step, _COLOURS[case.model], {"lw": 0.9}
        axes.bar(beside, value, 0.92 * step, yerr=error, capsize=2, color=colour, error_kw=thin, label=case.model)
    axes.axhline(1.0, color="#888888", lw=0.8)
    axes.set_xticks(at, [names[k] for k in keys], fontsize=9)
    axes.margins(y=0.18)
    finish(axes, y="relative to the solid (at z = 0)", ncols=3, loc="upper center")
    axes.grid(False, axis="x")


def _along(axes: Axes, own: Sequence[Case], key: str, label: str) -> None:
    """Draw a traction against x for each model; for the solid at its middle and at its end."""
    for case in own:
        for line, columns in case.lines.items():
            dashes, where = ("-", "") if line == "z = 0" else (":", ", end")
            where = ", z = 0" if case.model == "solid" and line == "z = 0" else where
            colour, name = _COLOURS[case.model], case.model + where
            axes.plot(columns["x_mm"], columns[key], dashes, marker=".", ms=3, lw=1.3, color=colour, label=name)
    reach = max((0.6 * c.numbers["contact_length_mm"] for c in own), default=0.0)
    if reach > 0.0:
        axes.set_xlim(-reach, reach)
    axes.axhline(0.0, color="#999999", lw=0.8)
    finish(axes, "x at rest (mm)", label, fontsize=9)


def draw_cost(
    path: Path, title: str, seconds: Sequence[float], errors: Mapping[str, Sequence[float]], own_s: float | None
) -> None:
    """Draw the expected error of each number against the seconds of a press, and write the picture.

    Parameters
    ----------
    path : PNG file to write
    title : of the scene
    seconds : (n,) of a press on each mesh
    errors : relative errors (n,) by name
    own_s : seconds on the mesh of the scene, if they are known
    """
    made = sheet(1, 1, (7.2, 4.4), (0.75, 2.2, 0.6, 0.1), title)
    (axes,) = made.axes
    order = sorted(range(len(seconds)), key=lambda k: seconds[k])
    for name, values in errors.items():
        axes.loglog([seconds[k] for k in order], [100.0 * values[k] for k in order], "o-", ms=4, lw=1.3, label=name)
    if own_s is not None:
        axes.axvline(own_s, color="0.4", lw=0.9, ls=":", label="this mesh")
    finish(axes, y="expected error, %", fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0))
    axes.set_xlabel("seconds of a press")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    made.save(path)


_MOST = 6  # columns with a panel
_PANELS_IN_A_ROW = 3  # panels beside each other
_MEASURED, _SIMULATED = "#222222", "#2166ac"
_FINE = 300  # points of the simulated curve


@dataclass(frozen=True)
class Panel:
    """A measured column.

    Attributes
    ----------
    name : of the column
    measured, std, simulated : (n,) measured values, their standard deviations, and simulated values
    curve : (k,) the simulated curve
    index : name of the quantity along which it was measured
    at, curve_at : (n,) and (k,) values of this quantity
    """

    name: str
    measured: Float
    std: Float
    simulated: Float
    curve: Float
    index: str
    at: Float
    curve_at: Float


def draw_identification(path: Path, panels: Sequence[Panel]) -> None:
    """Draw a panel for each of the first columns, and one for the residuals by each index; write a PNG file."""
    from scipy.interpolate import PchipInterpolator

    shown = panels[:_MOST]
    indices = list(dict.fromkeys(panel.index for panel in shown))
    count = len(shown) + len(indices)
    made = sheet(count, 2 if count in (2, 4) else _PANELS_IN_A_ROW, (5.2, 4.0), (0.9, 0.2, 0.65, 0.45))
    residuals = dict(zip(indices, made.axes[len(shown) :], strict=False))
    for panel, axes in zip(shown, made.axes, strict=False):
        fine = np.linspace(float(panel.curve_at[0]), float(panel.curve_at[-1]), _FINE)
        rising = np.argsort(panel.curve_at)
        curve = PchipInterpolator(panel.curve_at[rising], panel.curve[rising])(fine)
        axes.plot(fine, curve, color=_SIMULATED, lw=1.6, label="simulated")
        bars, name = 2.0 * panel.std, "measured, ±2 sd"
        axes.errorbar(panel.at, panel.measured, bars, fmt="o", ms=3.5, lw=1.0, capsize=2.0, color=_MEASURED, label=name)
        finish(axes, panel.index, panel.name, fontsize=9)
        away = (panel.measured - panel.simulated) / panel.std
        residuals[panel.index].plot(panel.at, away, "o-", ms=3, lw=0.8, label=panel.name)
    for index, axes in residuals.items():
        axes.axhspan(-2.0, 2.0, color="#888888", alpha=0.15, lw=0)
        finish(axes, index, "measured - simulated, over its sd", fontsize=8)
    made.save(path)


_MOST_KEYS = 5  # free keys with a panel
_ROWS = 2  # of panels, at most
_JUDGED, _BEST, _START = "#9db7d5", "#c0392b", "#222222"


def draw_optimisation(
    path: Path,
    keys: Sequence[str],
    places: Sequence[Sequence[float]],
    values: Sequence[float],
    start: Sequence[float],
) -> None:
    """Draw the designs with a finite sensitivity and write the picture.

    Parameters
    ----------
    path : PNG file to write
    keys : names of the k free keys
    places : (n, k) values of the free keys of every design, in order of evaluation
    values : (n,) sensitivity of every design; NaN if its solution failed
    start : (k,) values of the free keys of the initial design
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
        finish(axes, y="sensitivity", fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
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
    low = float(every.min())
    high = max(float(np.quantile(every, _HIGHEST)), 1.001 * low)
    for i, (one, axes) in enumerate(zip(maps, made.axes, strict=False)):
        x, y, value = one.places[:, 0], one.places[:, 1], one.mean_mu_sd
        drawn = axes.scatter(x, y, c=value, s=14, marker="s", cmap="viridis_r", vmin=low, vmax=high)
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


_MOST_NUMBERS, _MOST_BARS = 6, 10
"""Largest numbers of panels, and of bars in each."""

_LEAST = 1e-3
"""Effect, over the largest, below which a key is left out."""

_GROWS, _FALLS = "#2b6ca3", "#c0392b"


def draw_sensitivity(path: Path, title: str, numbers: Mapping[str, float], table: Sequence[Tree]) -> None:
    """Draw, for each number, its changes as each key falls and grows, with their errors.

    Rows of the table name number, key, change and both effects, the largest first.
    """
    names = list(numbers)[:_MOST_NUMBERS]
    count = min(sum(row["number"] == names[0] for row in table), _MOST_BARS)
    made = sheet(len(names), min(len(names), 2), (6.4, 1.2 + 0.36 * count), (2.4, 0.3, 0.6, 0.3), title)
    for name, axes in zip(names, made.axes, strict=False):
        rows = [row for row in table if row["number"] == name][:count]
        largest = max(_size(row) for row in rows)
        shown = [row for row in rows if _size(row) > _LEAST * largest]
        for way, sign, offset, colour in (("falling", "less", -0.2, _FALLS), ("growing", "plus", 0.2, _GROWS)):
            errors = np.nan_to_num([row[f"{way}_error"] for row in shown])
            places = np.arange(len(shown)) + offset
            values = np.nan_to_num([row[way] for row in shown])
            axes.barh(places, values, 0.36, xerr=errors, color=colour, label=f"key {sign} its change",
                      error_kw={"lw": 0.8, "ecolor": "0.2"})  # fmt: skip
        axes.set_yticks(range(len(shown)), [f"{row['key']} by {row['change']:.3g}" for row in shown], fontsize=8)
        axes.invert_yaxis()
        axes.locator_params(axis="x", nbins=5)
        axes.axvline(0.0, color="0.3", lw=0.8)
        axes.legend(fontsize=7)
        finish(axes, x=f"change of {name} = {numbers[name]:.4g}")
    made.save(path)


def _size(row: Tree) -> float:
    return float(np.nanmax(np.abs([row["falling"], row["growing"]])))
