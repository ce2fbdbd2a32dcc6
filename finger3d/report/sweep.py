"""The page of a sweep, from what is in its folder."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from finger3d.report.build import Code, HeadlineRow, PageSection, Table, write_page
from finger3d.report.chart import Chart, Line
from finger3d.results.summary import read_json, read_rows, title_of

_MOST_ROWS = 500

_MOST_KEYS, _MOST_GAUGES, _MOST_LINES = 3, 2, 8  # of the charts of a sweep


def sweep_page(folder: str | Path) -> Path:
    """Write report.html of a sweep; of a long table the first rows only.

    Raises
    ------
    Finger3dError
        If there is no sweep.json to read, or the page cannot be written.
    """
    folder = Path(folder)
    data = read_json(folder / "sweep.json")
    rows = read_rows(folder / "results.csv")
    failed = [row for row in rows if row["outcome"] != "converged"]
    forces = [float(row["normal_force_N"]) for row in rows if row["outcome"] == "converged"]
    names = [*data["vary"], "normal_force_N", "friction_sum_N", "contact_half_length_mm", "stick_half_length_mm"]
    names += [name for name in (rows[0] if rows else {}) if name.startswith("gauge_")] + ["outcome"]
    headline = [
        HeadlineRow("points", f"{len(rows)} of {data['points']}"),
        HeadlineRow("bodies", str(len(data["bodies"]))),
    ]
    if forces:
        headline.append(HeadlineRow("normal force", f"{min(forces):.4g} to {max(forces):.4g}", "N"))
    shown = [tuple(_number(row.get(name, "")) for name in names) for row in rows[:_MOST_ROWS]]
    more = [f"The first {_MOST_ROWS} of {len(rows)} points; all are in results.csv."] if len(rows) > _MOST_ROWS else []
    varied = [(key, ", ".join(values)) for key, values in data["vary"].items()]
    return write_page(
        folder,
        f"{title_of(data['scene'])}: sweep over {', '.join(data['vary'])}",
        headline,
        [
            PageSection("Points", [*more, Table(tuple(names), shown)]),
            PageSection("Varied", [Table(("key", "values"), varied)]),
            PageSection("Scene", [Code(json.dumps(data["scene"], indent=2), "the scene that was varied")]),
        ],
        charts=sweep_charts(rows, list(data["vary"])),
        command="sweep",
        outcome=f"{len(rows) - len(failed)} of {data['points']} points converged",
        good=len(rows) == data["points"] and not failed,
        notes=[f"point {row['point']}: {row['outcome']}" for row in failed[:10]],
    )


def sweep_charts(rows: Sequence[Mapping[str, str]], keys: Sequence[str]) -> list[Chart]:
    """Normal force and gauge strains, in turn, against each varied key that has several numbers.

    Parameters
    ----------
    rows : of results.csv; those without numbers are left out
    keys : varied; every setting of the others than a chart's own is a line of it
    """
    good = [{name: _number(text) for name, text in row.items()} for row in rows if row["outcome"] == "converged"]
    values = {key: {row[key] for row in good} for key in keys}
    along = [key for key, of in values.items() if len(of) > 1 and all(isinstance(v, float) for v in of)]
    gauges = [name for name in (good[0] if good else {}) if name.startswith("gauge_")]
    told = {"normal_force_N": ("Normal force", "normal force (N)")}
    for name in gauges[:_MOST_GAUGES]:
        gauge = name.removeprefix("gauge_")
        told[name] = (f"Strain, {gauge}", f"strain, {gauge}")
    found = []
    for name, (called, title) in told.items():
        for key in along[:_MOST_KEYS]:
            others = [k for k in keys if k != key]
            lines: dict[str, list[tuple[float, float]]] = {}
            for row in good:
                setting = ", ".join(f"{v:.12g}" if isinstance(v, float) else v for v in (row[k] for k in others))
                lines.setdefault(setting, []).append((row[key], row[name]))
            shown = [
                Line(label, *zip(*sorted(points), strict=True)) for label, points in list(lines.items())[:_MOST_LINES]
            ]
            left_out = len(lines) - len(shown)
            found.append(Chart(f"{called} against {key}", key, title, shown, ", ".join(others), left_out))
    return found


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text
