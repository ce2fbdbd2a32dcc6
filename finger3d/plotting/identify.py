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
    """A measured column: values and standard deviations (n,), simulated values (n,), and the simulated curve (k,)."""

    name: str
    measured: Float
    std: Float
    simulated: Float
    curve: Float


def draw(path: Path, index: str, at: Float, curve_at: Float, panels: Sequence[Panel]) -> None:
    """Draw a panel for each of the first measured columns, and one for all residuals; write a PNG file.

    Parameters
    ----------
    index : name of the quantity along which the press was measured
    at, curve_at : (n,) and (k,) its values at the measured rows, and at the simulated increments
    """
    from scipy.interpolate import PchipInterpolator

    shown = panels[:_MOST]
    columns = 2 if len(shown) in (1, 3) else _COLUMNS
    made = sheet(len(shown) + 1, columns, (5.2, 4.0), (0.9, 0.2, 0.65, 0.45))
    fine = np.linspace(float(curve_at[0]), float(curve_at[-1]), _FINE)
    rising = np.argsort(curve_at)
    last = made.axes[len(shown)]
    for panel, axes in zip(shown, made.axes, strict=False):
        curve = PchipInterpolator(curve_at[rising], panel.curve[rising])(fine)
        axes.plot(fine, curve, color=_SIMULATED, lw=1.6, label="simulated")
        axes.errorbar(
            at,
            panel.measured,
            2.0 * panel.std,
            fmt="o",
            ms=3.5,
            lw=1.0,
            capsize=2.0,
            color=_MEASURED,
            label="measured, ±2 sd",
        )
        finish(axes, index, panel.name, fontsize=9)
        last.plot(at, (panel.measured - panel.simulated) / panel.std, "o-", ms=3, lw=0.8, label=panel.name)
    last.axhspan(-2.0, 2.0, color="#888888", alpha=0.15, lw=0)
    finish(last, index, "measured - simulated, over its sd", fontsize=8)
    made.save(path)
