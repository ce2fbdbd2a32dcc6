"""sweep.png: what changes with what was varied, a panel for each key that has several numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from finger3d.export import atomic

_MOST_LINES = 8
_MOST_PANELS = 3


def draw(path: Path, columns: Mapping[str, Sequence[Any]], keys: Sequence[str]) -> bool:
    """Draw the normal force (and the first gauge's strain) against each varied number; a line for each other setting.

    Returns
    -------
    bool
        Whether there was anything to draw.
    """
    good = np.array([outcome == "converged" for outcome in columns["outcome"]], dtype=bool)
    along = [k for k in keys if len(set(columns[k])) > 1 and not isinstance(columns[k][0], str)][:_MOST_PANELS]
    if not along or not good.any():
        return False
    told = ["normal_force_N", *[name for name in columns if name.startswith("gauge_")][:1]]
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.6 * len(along), 3.9 * len(told)), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(told), len(along), squeeze=False)
    for row, name in zip(panels, told, strict=True):
        for axes, key in zip(row, along, strict=True):
            _panel(axes, columns, good, key, [k for k in keys if k != key], name)
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png")
    return True


def _panel(
    axes: Any, columns: Mapping[str, Sequence[Any]], good: Any, key: str, others: Sequence[str], name: str
) -> None:
    x, y = np.array(columns[key], dtype=float), np.array(columns[name], dtype=float)
    settings = [tuple(columns[k][i] for k in others) for i in range(len(x))]
    lines = list(dict.fromkeys(s for s, ok in zip(settings, good, strict=True) if ok))
    for line in lines[:_MOST_LINES]:
        on = np.flatnonzero(good & np.array([s == line for s in settings]))
        on = on[np.argsort(x[on], kind="stable")]
        label = ", ".join(
            f"{k} = {v:g}" if isinstance(v, float) else f"{k} = {v}" for k, v in zip(others, line, strict=True)
        )
        axes.plot(x[on], y[on], "o-", ms=4, lw=1.2, label=label or None)
    if len(lines) > _MOST_LINES:
        axes.plot([], [], " ", label=f"and {len(lines) - _MOST_LINES} more")
    axes.set_xlabel(key)
    axes.set_ylabel("normal force (N)" if name == "normal_force_N" else f"strain, {name.removeprefix('gauge_')}")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, color="#e4e4e4", lw=0.6)
    if others and lines:
        axes.legend(frameon=False, fontsize=8)
