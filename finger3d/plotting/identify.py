"""identify.png: measured points over the simulated press, and the residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finger3d._types import Float
from finger3d.plotting.layout import finish, sheet

_MOST = 6  # columns with a panel
_COLUMNS = 3  # panels beside each other
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


def draw(path: Path, panels: Sequence[Panel]) -> None:
    """Draw a panel for each of the first columns, and one for the residuals by each index; write a PNG file."""
    from scipy.interpolate import PchipInterpolator

    shown = panels[:_MOST]
    indices = list(dict.fromkeys(panel.index for panel in shown))
    count = len(shown) + len(indices)
    made = sheet(count, 2 if count in (2, 4) else _COLUMNS, (5.2, 4.0), (0.9, 0.2, 0.65, 0.45))
    residuals = dict(zip(indices, made.axes[len(shown) :], strict=False))
    for panel, axes in zip(shown, made.axes, strict=False):
        fine = np.linspace(float(panel.curve_at[0]), float(panel.curve_at[-1]), _FINE)
        rising = np.argsort(panel.curve_at)
        curve = PchipInterpolator(panel.curve_at[rising], panel.curve[rising])(fine)
        axes.plot(fine, curve, color=_SIMULATED, lw=1.6, label="simulated")
        axes.errorbar(
            panel.at,
            panel.measured,
            2.0 * panel.std,
            fmt="o",
            ms=3.5,
            lw=1.0,
            capsize=2.0,
            color=_MEASURED,
            label="measured, ±2 sd",
        )
        finish(axes, panel.index, panel.name, fontsize=9)
        away = (panel.measured - panel.simulated) / panel.std
        residuals[panel.index].plot(panel.at, away, "o-", ms=3, lw=0.8, label=panel.name)
    for index, axes in residuals.items():
        axes.axhspan(-2.0, 2.0, color="#888888", alpha=0.15, lw=0)
        finish(axes, index, "measured - simulated, over its sd", fontsize=8)
    made.save(path)
