"""A sweep as a picture for paper and slides: the charts of its page, a panel each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from finger3d.errors import Finger3dError
from finger3d.plotting.layout import sheet
from finger3d.report.chart import Chart
from finger3d.report.sweep import sweep_charts
from finger3d.results.summary import read_json, read_rows

_LINE = 0.21  # inches of a line of the legend,
_WIDE = 64  # and letters that fit into it


def picture(folder: str | Path, path: str | Path) -> None:
    """Draw what is kept of a sweep.

    Parameters
    ----------
    folder : of the sweep
    path : of the PNG file

    Raises
    ------
    Finger3dError
        If nothing of it can be drawn, or the file cannot be written.
    """
    folder = Path(folder)
    try:
        keys = list(read_json(folder / "sweep.json")["vary"])
        charts = sweep_charts(read_rows(folder / "results.csv"), keys)
    except (KeyError, TypeError, ValueError):  # a spreadsheet may have saved them anew
        raise Finger3dError(
            f"{folder}: sweep.json or results.csv is not as a sweep wrote it; remove the folder, and sweep again"
        ) from None
    if not charts:
        raise Finger3dError(f"{folder}: nothing to draw; no varied key has two numbers among the points that converged")
    draw(path, charts)


def draw(path: str | Path, charts: Sequence[Chart]) -> None:
    """Draw charts, those of one y in a row."""
    columns = len({chart.x for chart in charts})
    high = max(1 + math.ceil((len(chart.lines) + bool(chart.more)) / _abreast(chart)) for chart in charts)
    below = 0.65 + _LINE * high * any(chart.legend for chart in charts)
    made = sheet(len(charts) // columns, columns, (5.6, 3.5 + below), (0.9, 0.15, below, 0.2))
    for axes, chart in zip(made.axes, charts, strict=True):
        _panel(axes, chart)
    made.save(path)


def _abreast(chart: Chart) -> int:
    """How many labels have room beside each other in a panel."""
    return max(1, min(4, _WIDE // (6 + max(len(line.label) for line in chart.lines))))


def _panel(axes: Any, chart: Chart) -> None:
    for line in chart.lines:
        axes.plot(line.x, line.y, "o-", ms=4, lw=1.2, label=line.label)
    if chart.more:
        axes.plot([], [], " ", label=f"and {chart.more} more")
    axes.set_xlabel(chart.x)
    axes.set_ylabel(chart.y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, color="#e4e4e4", lw=0.6)
    if chart.legend:
        axes.legend(
            title=chart.legend, frameon=False, fontsize=9, title_fontsize=9, loc="upper center",
            bbox_to_anchor=(0.45, -0.13), ncols=_abreast(chart),
        )  # fmt: skip
