"""The pages of a calibration and of a sweep, from what is in their folders."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from finger3d.page.build import Code, Figure, Row, Section, Table, write_page
from finger3d.page.chart import Chart, Line
from finger3d.page.results import how_modelled, read_json, read_rows, title_of

_MOST_ROWS = 500
_MOST_KEYS, _MOST_GAUGES, _MOST_LINES = 3, 2, 8  # of the charts of a sweep


def calibrate_page(folder: str | Path) -> Path:
    """Write report.html of a calibration.

    Raises
    ------
    Finger3dError
        If there is no calibration.json to read, or the page cannot be written.
    """
    folder = Path(folder)
    data = read_json(folder / "calibration.json")
    mu, strain, sd = data["curve"]["mu"], data["curve"]["strain"], data["mu_sd"]
    ranges = {
        key: ", ".join(f"{s['low']:.3g} to {s['high']:.3g}" for s in data[key]) or "none"
        for key in ("trusted", "usable")
    }
    known = [(i, s) for i, s in enumerate(sd) if s is not None]
    best = min(known, key=lambda pair: pair[1], default=None)
    headline = [
        Row(f"mu within {data['resolution_limit']:g}, all tolerances", ranges["trusted"]),
        Row("the same from strain noise alone", ranges["usable"]),
        Row(f"strain at mu = {mu[0]:g}", strain[0]),
        Row(f"strain at mu = {mu[-1]:g}", strain[-1]),
        Row("residual of the second-order fit, rms", f"{data['fit']['residual_rms']:.2g}"),
    ]
    if best:
        headline.append(Row(f"mu \u00b1 at mu = {mu[best[0]]:.3g}, all tolerances", f"{best[1]:.2g}"))
    a, b, c = data["fit"]["coefficients"]
    curve = Table(
        ("mu", "strain", "resolution of mu", "sd of mu"), list(zip(mu, strain, data["resolution"], sd, strict=True))
    )
    causes = Table(
        ("not known exactly", "standard deviation", "unit", "sd of mu at the best place"),
        [(name, t["sd"], t["unit"], t["mu_sd"][best[0]] if best else "") for name, t in data["tolerances"].items()],
    )
    use = f"finger3d estimate {folder}/calibration.json --strain {strain[len(strain) // 2]:.4g}"
    failed = [f"mu = {f['mu']:g}: {f['why']}" for f in data["failed"]]
    return write_page(
        folder,
        f"{title_of(data['scene'])}: gauge {data['gauge']} against friction",
        headline,
        [
            Section("Verdict", [data["verdict"]]),
            Section("Curve", [f"Second order: strain = {a:.5g} {b:+.5g} mu {c:+.5g} mu\u00b2", curve, causes]),
            Section("Scene", how_modelled(data, folder)),
            Section("Use it", [Code(use)]),
        ],
        [Figure("calibration.png", "Strain and fit, resolution, and what the uncertainty of mu is made of"),
         Figure("map.png", "Where strains follow friction")],
        command="calibrate",
        outcome="converged" if not failed else f"{len(failed)} values of mu gave no numbers",
        good=not failed,
        notes=failed,
        versions=data["about"].get("versions"),
    )  # fmt: skip


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
    headline = [Row("points", f"{len(rows)} of {data['points']}"), Row("bodies", str(len(data["bodies"])))]
    if forces:
        headline.append(Row("normal force", f"{min(forces):.4g} to {max(forces):.4g}", "N"))
    shown = [tuple(_number(row.get(name, "")) for name in names) for row in rows[:_MOST_ROWS]]
    more = [f"The first {_MOST_ROWS} of {len(rows)} points; all are in results.csv."] if len(rows) > _MOST_ROWS else []
    varied = [(key, ", ".join(values)) for key, values in data["vary"].items()]
    return write_page(
        folder,
        f"{title_of(data['scene'])}: sweep over {', '.join(data['vary'])}",
        headline,
        [
            Section("Points", [*more, Table(tuple(names), shown)]),
            Section("Varied", [Table(("key", "values"), varied)]),
            Section("Scene", [Code(json.dumps(data["scene"], indent=2), "the scene that was varied")]),
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
