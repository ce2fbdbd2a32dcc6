"""Picture of a sweep: the charts of its page, one panel each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d.errors import Finger3dError
from finger3d.plotting.layout import finish, sheet
from finger3d.report.chart import Chart
from finger3d.report.sweep import sweep_charts
from finger3d.results.summary import read_json, read_rows, strains_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LINE_HEIGHT = 0.21  # of a line of the legend, in inches
_LINE_LENGTH = 64  # characters of a line of the legend
_MOST_COLUMNS = 4  # of the legend
_SYMBOL_LENGTH = 6  # of the symbol of a legend entry, in characters


def picture(folder: str | Path, path: str | Path) -> None:
    """Draw the charts of a sweep from its results folder.

    Parameters
    ----------
    folder : results folder of a sweep
    path : PNG file to write

    Raises
    ------
    Finger3dError
        If there is nothing to draw, the results are damaged, or the file cannot be written.
    """
    folder = Path(folder)
    try:
        data = read_json(folder / "sweep.json")
        rows, strains = read_rows(folder / "results.csv"), strains_of(data["scene"])
        charts = sweep_charts(rows, list(data["vary"]), strains, data.get("list", False))
    except (KeyError, TypeError, ValueError):  # for instance saved by a spreadsheet
        raise Finger3dError(
            f"{folder}: sweep.json or results.csv is not as a sweep wrote it; remove the folder, and sweep again"
        ) from None
    if not charts:
        raise Finger3dError(f"{folder}: nothing to draw; no varied key has two numbers among the points that converged")
    draw(path, charts)


def draw(path: str | Path, charts: Sequence[Chart]) -> None:
    """Draw charts and write the picture; charts of one quantity form a row."""
    columns = len({chart.x for chart in charts})
    high = max(1 + math.ceil((len(chart.lines) + bool(chart.more)) / _columns(chart)) for chart in charts)
    below = 0.65 + _LINE_HEIGHT * high * any(chart.legend for chart in charts)
    made = sheet(len(charts), columns, (5.6, 3.5 + below), (0.9, 0.15, below, 0.2))
    for axes, chart in zip(made.axes, charts, strict=True):
        _panel(axes, chart)
    made.save(path)


def _columns(chart: Chart) -> int:
    """Return the number of columns of the legend of a panel."""
    return max(1, min(_MOST_COLUMNS, _LINE_LENGTH // (_SYMBOL_LENGTH + max(len(line.label) for line in chart.lines))))


def _panel(axes: Axes, chart: Chart) -> None:
    for line in chart.lines:
        axes.plot(line.x, line.y, "o-" if chart.joined else "o", ms=4, lw=1.2, label=line.label)
    if chart.more:
        axes.plot([], [], " ", label=f"and {chart.more} more")
    place = {"loc": "upper center", "bbox_to_anchor": (0.45, -0.13), "ncols": _columns(chart)}
    legend = {"title": chart.legend, "fontsize": 9, "title_fontsize": 9, **place} if chart.legend else {}
    finish(axes, chart.x, chart.y, **legend)
