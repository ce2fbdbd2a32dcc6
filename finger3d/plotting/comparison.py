"""compare.png: force per width against width, tractions along x, and the other quantities of each model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from finger3d.plotting.layout import WIDEST, finish, sheet
from finger3d.results.comparison import FORCE, SHOWN, Case

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = {"plane strain": "#b2182b", "plane stress": "#2166ac", "solid": "#222222"}
_MOST_QUANTITIES = 9  # groups of bars


def draw(path: Path, cases: Sequence[Case], own_width_mm: float, title: str) -> None:
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
        if case.is_section:
            value, error = case.numbers[FORCE], case.errors.get(FORCE, 0.0)
            axes.axhspan(value - error, value + error, color=_COLOURS[case.model], alpha=0.15, lw=0)
            axes.axhline(value, color=_COLOURS[case.model], ls="--", lw=1.2, label=case.model)
    width = [c.width_mm for c in solids]
    axes.errorbar(
        width,
        [c.numbers[FORCE] for c in solids],
        [c.errors.get(FORCE, 0.0) for c in solids],
        fmt="o-",
        ms=5,
        lw=1.3,
        capsize=3,
        color=_COLOURS["solid"],
        label="solid",
    )
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
        axes.bar(
            at + (i - 0.5 * (len(own) - 1)) * step,
            value,
            0.92 * step,
            yerr=error,
            capsize=2,
            color=_COLOURS[case.model],
            error_kw={"lw": 0.9},
            label=case.model,
        )
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
            axes.plot(
                columns["x_mm"],
                columns[key],
                dashes,
                marker=".",
                ms=3,
                lw=1.3,
                color=_COLOURS[case.model],
                label=case.model + where,
            )
    reach = max((0.6 * c.numbers["contact_length_mm"] for c in own), default=0.0)
    if reach > 0.0:
        axes.set_xlim(-reach, reach)
    axes.axhline(0.0, color="#999999", lw=0.8)
    finish(axes, "x at rest (mm)", label, fontsize=9)
