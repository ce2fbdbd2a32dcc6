"""identify.png: measured points over the simulated press, and the residuals."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d.plotting.layout import sheet, style

if TYPE_CHECKING:
    from finger3d.analyses.identify.run import Identification

_MOST = 6  # columns with a panel
_COLUMNS = 3  # panels beside each other
_MEASURED, _SIMULATED = "#222222", "#2166ac"
_FINE = 300  # points of the simulated curve


def draw(path: Path, found: Identification) -> None:
    """Draw a panel for each of the first measured columns, and one for all residuals; write a PNG file."""
    from scipy.interpolate import PchipInterpolator

    data = found.measured
    names = list(data.columns)[:_MOST]
    columns = 2 if len(names) in (1, 3) else _COLUMNS
    made = sheet(math.ceil((len(names) + 1) / columns), columns, (5.2, 4.0), (0.9, 0.2, 0.65, 0.45))
    offset = dict(zip(found.keys, found.fitted.values, strict=True)).get("depth_offset_mm", 0.0)
    fine = np.linspace(0.0, float(found.curve[data.index][-1]), _FINE)
    for name, axes in zip(names, made.axes, strict=False):
        curve = PchipInterpolator(found.curve[data.index], found.curve[name])(fine)
        axes.plot(fine, curve, color=_SIMULATED, lw=1.6, label="simulated")
        axes.errorbar(
            data.at + offset, data.columns[name], 2.0 * found.stds[name], fmt="o", ms=3.5, lw=1.0, capsize=2.0,
            color=_MEASURED, label="measured, ±2 sd",
        )  # fmt: skip
        axes.set_xlabel(data.index)
        axes.set_ylabel(name)
        axes.legend(frameon=False, fontsize=9)
        style(axes)
    last = made.axes[len(names)]
    for name in names:
        residual = (data.columns[name] - found.simulated[name]) / found.stds[name]
        last.plot(data.at + offset, residual, "o-", ms=3, lw=0.8, label=name)
    last.axhspan(-2.0, 2.0, color="#888888", alpha=0.15, lw=0)
    last.set_xlabel(data.index)
    last.set_ylabel("measured - simulated, over its sd")
    last.legend(frameon=False, fontsize=8)
    style(last)
    for axes in made.axes[len(names) + 1 :]:
        axes.set_axis_off()
    made.save(path)
