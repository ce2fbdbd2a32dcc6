"""Page and picture of a sweep."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d.errors import Finger3dError
from finger3d.mechanics.readings import Column
from finger3d.plotting.layout import finish, sheet
from finger3d.report.build import Chart, Code, HeadlineRow, Line, Page, PageSection, Table
from finger3d.results.summary import read_json, read_rows, strains_of, title_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_MOST_ROWS = 500  # of the table of points
_MOST_FAILURES = 10  # listed below the headline
_MOST_KEYS, _MOST_GAUGES = 3, 2  # varied keys and gauges with a chart
_MOST_LINES = 8  # of a chart


def sweep_page(folder: str | Path) -> Page:
    """Return the page of a sweep, from the files in its folder; a long table is cut.

    Raises
    ------
    Finger3dError
        If sweep.json cannot be read.
    """
    folder = Path(folder)
    data = read_json(folder / "sweep.json")
    rows = read_rows(folder / "results.csv")
    failed = [row for row in rows if row["outcome"] != "converged"]
    forces = [float(row["normal_force_N"]) for row in rows if row["outcome"] == "converged"]
    strains = strains_of(data["scene"])
    headline = [
        HeadlineRow("points", f"{len(rows)} of {data['points']}"),
        HeadlineRow("bodies", str(len(data["bodies"]))),
    ]
    if forces:
        headline.append(HeadlineRow("normal force", f"{min(forces):.4g} to {max(forces):.4g}", "N"))
    more = [f"The first {_MOST_ROWS} of {len(rows)} points; all are in results.csv."] if len(rows) > _MOST_ROWS else []
    is_list = data.get("list", False)
    varied = [(key, _values(values, is_list)) for key, values in data["vary"].items()]
    return Page(
        f"{title_of(data['scene'])}: sweep over {', '.join(data['vary'])}",
        headline,
        [
            PageSection("Points", [*more, points_table(folder, _MOST_ROWS)]),
            PageSection("Varied", [Table(("key", "values"), varied)]),
            PageSection("Scene", [Code(json.dumps(data["scene"], indent=2), "scene before the variation")]),
        ],
        charts=sweep_charts(rows, list(data["vary"]), strains, is_list),
        command="sweep",
        outcome=f"{len(rows) - len(failed)} of {data['points']} points converged",
        good=len(rows) == data["points"] and not failed,
        notes=[f"point {row['point']}: {row['outcome']}" for row in failed[:_MOST_FAILURES]],
    )


def points_table(folder: str | Path, most: int) -> Table:
    """Return the first points: varied keys, forces, half extents of contact and stick, strains, and the outcome."""
    data, rows = read_json(Path(folder) / "sweep.json"), read_rows(Path(folder) / "results.csv")
    names = [*data["vary"], "normal_force_N", "friction_sum_N", "contact_half_length_mm", "stick_half_length_mm"]
    names += [*(column.key for column in strains_of(data["scene"]) if rows and column.key in rows[0]), "outcome"]
    return Table(names, [tuple(_number(row.get(name, "")) for name in names) for row in rows[:most]])


def _values(texts: Sequence[str], is_list: bool) -> str:
    """Return the values of a key; of a list of points, how many there are and between which numbers."""
    numbers = [value for value in map(_number, texts) if isinstance(value, float)]
    if not is_list or len(numbers) < len(texts):
        return ", ".join(dict.fromkeys(texts))
    return f"{len(set(numbers))} values from {min(numbers):.6g} to {max(numbers):.6g}"


def sweep_charts(
    rows: Sequence[Mapping[str, str]], keys: Sequence[str], strains: Sequence[Column] = (), is_list: bool = False
) -> list[Chart]:
    """Return charts of the normal force and of gauge strains against each varied key with several numeric values.

    Parameters
    ----------
    rows : rows of results.csv; points that failed are ignored
    keys : varied keys; a chart against one of them has a line for each combination of the others
    strains : columns of gauges
    is_list : whether the points are a list: each is then drawn by itself
    """
    good = [{name: _number(text) for name, text in row.items()} for row in rows if row["outcome"] == "converged"]
    values = {key: {row[key] for row in good} for key in keys}
    along = [key for key, of in values.items() if len(of) > 1 and all(isinstance(v, float) for v in of)]
    titles = {"normal_force_N": ("Normal force", "normal force (N)")}
    shown_strains = [column for column in strains if good and column.key in good[0]][:_MOST_GAUGES]
    titles |= {c.key: (f"Strain, {c.sensor}", f"strain, {c.sensor}") for c in shown_strains}
    found = []
    for name, (quantity, title) in titles.items():
        for key in along[:_MOST_KEYS]:
            others = [] if is_list else [k for k in keys if k != key]
            lines: dict[str, list[tuple[float, float]]] = {}
            for row in good:
                setting = ", ".join(f"{v:.12g}" if isinstance(v, float) else v for v in (row[k] for k in others))
                lines.setdefault(setting, []).append((float(row[key]), float(row[name])))
            shown = [
                Line(label, *zip(*sorted(points), strict=True)) for label, points in list(lines.items())[:_MOST_LINES]
            ]
            left_out = len(lines) - len(shown)
            legend = ", ".join(others)
            found.append(Chart(f"{quantity} against {key}", key, title, shown, legend, left_out, joined=not is_list))
    return found


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


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
