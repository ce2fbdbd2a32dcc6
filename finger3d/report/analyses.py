"""Pages of the analyses and of sweeps."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d.errors import Finger3dError
from finger3d.mechanics.readings import Column
from finger3d.plotting.layout import finish, sheet
from finger3d.report.build import Chart, Code, Figure, HeadlineRow, Line, Page, PageSection, Table, how_modelled, number
from finger3d.results.summary import FORCE, read_json, read_rows, strains_of, title_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def calibrate_page(folder: str | Path) -> Page:
    """Return the page of a calibration, from the files in its folder.

    Raises
    ------
    Finger3dError
        If calibration.json cannot be read.
    """
    folder = Path(folder)
    data = read_json(folder / "calibration.json")
    mu, sd, status, readings = data["mu"], data["mu_sd"], data["status"], data["readings"]
    known = [i for i, what in enumerate(status) if what in ("ok", "coarse")]
    best = min(known, key=lambda i: sd[i], default=len(mu) // 2)
    ranges = {
        key: ", ".join(f"{s['low']:.3g} to {s['high']:.3g}" for s in data[key]) or "none"
        for key in ("trusted", "usable")
    }
    shown = ["" if s is None else s for s in sd]
    headline = [
        HeadlineRow(f"mu found within {data['resolution_limit']:g}, all tolerances", ranges["trusted"]),
        HeadlineRow("the same by the noise alone", ranges["usable"]),
        HeadlineRow(f"mu \u00b1 at mu = {mu[best]:.3g}, all tolerances", f"{sd[best]:.2g}" if known else "unknown"),
    ]
    each = Table(
        ("reading", "unit", "noise", f"at mu = {mu[0]:g}", f"at mu = {mu[-1]:g}", "second-order fit, residual rms"),
        [
            (name, r["unit"], r["noise"], r["curve"][0], r["curve"][-1], r["fit"]["residual_rms"])
            for name, r in readings.items()
        ],
    )
    curves = zip(mu, *(r["curve"] for r in readings.values()), shown, status, strict=True)
    curve = Table(("mu", *readings, "standard deviation of mu", "an estimate there is"), list(curves))
    falls = [(name, f"{100.0 * share[best]:.1f} %") for name, share in data["variance_reductions"].items()]
    fall = f"fall of the variance of mu at {mu[best]:.3g} if it were known exactly"
    causes = Table(("uncertain quantity", fall), falls)
    given = " ".join(f"--strain {name}={r['curve'][best]:.5g}" for name, r in readings.items())
    failed = [f"mu = {f['mu']:g}: {f['why']}" for f in data["failed"]]
    note = data["about"].get("mesh", {}).get("note")
    return Page(
        f"{title_of(data['scene'])}: {', '.join(readings)} against friction",
        headline,
        [
            PageSection("Verdict", [data["verdict"]]),
            PageSection("Readings", [each, curve, causes]),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Use it", [Code(f"finger3d estimate {folder}/calibration.json {given}")]),
        ],
        [Figure("calibration.png", "Readings, standard deviation of mu, and what would reduce its variance")],
        command="calibrate",
        outcome="converged" if not failed else f"{len(failed)} values of mu gave no numbers",
        good=not failed,
        notes=[*failed, *([note] if note else [])],
        versions=data["about"].get("versions"),
    )


def compare_page(folder: str | Path) -> Page:
    """Return the page of a comparison, from the files in its folder.

    Raises
    ------
    Finger3dError
        If compare.json cannot be read.
    """
    folder = Path(folder)
    data = read_json(folder / "compare.json")
    numbers = data.get("table", ())
    own = data["scene"]["finger"].get("width_mm")
    cases = [c for c in data["cases"] if c["numbers"]]
    headline = [
        HeadlineRow(f"force per width, {c['model']}", c["numbers"][FORCE], "N/mm", c["errors"].get(FORCE))
        for c in cases
        if c["width_mm"] == own
    ]
    keys = list(dict.fromkeys(k for c in cases for k in c["numbers"]))
    rows = []
    for c in data["cases"]:
        told = (number(c["numbers"][k], c["errors"].get(k)) if k in c["numbers"] else "" for k in keys)
        rows.append((c["model"], c["width_mm"], c["size_mm"], *told, c["seconds"], c["outcome"]))
    head = ("model", "width (mm)", "edges (mm)", *keys, "seconds", "outcome")
    proof = (
        "Each case is a separate press. It has numbers only if every increment satisfies Eqs. (1)-(4) of Maeno 2004, "
        "and friction opposes slip, to 1e-8. finger3d press reports the increments of a scene."
    )
    return Page(
        f"{title_of(data['scene'])}: 2D against 3D",
        headline,
        [
            PageSection("Verdict", [*data["verdict"], *([Table(numbers[0], numbers[1:])] if numbers else [])]),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Every case", [proof, _BARS, Table(head, rows)]),
        ],
        [Figure("compare.png", "Force against width, tractions along x, and all quantities relative to the solid")],
        command="compare",
        outcome=data["outcome"],
        good=data["outcome"] == "converged",
        versions=data["versions"],
    )


_BARS = (
    "The number after ± is the error of mesh and increments. It is estimated, as by finger3d press, from a mesh with "
    "edges about twice as long (half as long if no coarser mesh is possible), and from more increments. Solids and "
    "sections of one width have the same edge lengths; on swept meshes the difference of their forces is therefore "
    "more accurate than either force. The verdict calls a deviation significant if it exceeds two error bars."
)


_STABLE = (
    "To these stretches the nominal stress of the fitted law rises and it satisfies Drucker's postulate; 10, and 0.1 "
    "in compression, are the last that were tried. Tension, shear and equibiaxial tension all count as measured to the "
    "largest stretch of any test."
)


def identify_page(folder: str | Path) -> Page:
    """Return the page of an identification, from the files in its folder.

    Raises
    ------
    Finger3dError
        If identify.json or task.json cannot be read.
    """
    folder = Path(folder)
    data, task = read_json(folder / "identify.json"), read_json(folder / "task.json")
    values, bounds = data["values"], {key: (low, high) for key, low, high in task["free"]}
    headline = [
        *(HeadlineRow(key, f"{v['value']:.4g} \u00b1 {v['std']:.2g}") for key, v in values.items()),
        HeadlineRow("presses solved", str(data["presses"])),
    ]
    stable = data.get("stable")
    if stable:
        within = "over the measured range" if stable["over_measured_range"] else "not over the measured range"
        headline.append(HeadlineRow("law is stable", within))
    found = Table(
        ("key", "from", "to", "value", "standard deviation", "68 % interval"),
        [(key, *bounds[key], v["value"], v["std"], f"{v['low']:.4g} to {v['high']:.4g}") for key, v in values.items()],
    )
    correlated = [(key, *(f"{r:.3f}" for r in row.values())) for key, row in data["correlation"].items()]
    correlation = Table(("correlation", *values), correlated)
    stds = data["std_of_columns"]
    fitted = [(n, rms, stds[n]["rms"], stds[n]["from"]) for n, rms in data["residual_rms"].items()]
    columns = Table(("measured column", "residual, rms", "standard deviation, rms", "from"), fitted)
    ends = [(mode, to, stable["measured_to"][mode]) for mode, to in stable["rises_to"].items()] if stable else []
    stability = Table(("mode", "stable to a stretch of", "measured to"), ends)
    sources = [path for path in (data["measured"], *data.get("material_tests", ())) if path]
    told = f"Standard deviations are {data['deviations']}."
    scene = folder / "identified.toml"
    return Page(
        f"{title_of(data['scene'])}: values from {', '.join(Path(path).name for path in sources)}",
        headline,
        [
            PageSection("Values", [told, *data["notes"], found, *([correlation] if len(values) > 1 else [])]),
            PageSection("Fit", [columns]),
            *([PageSection("Stability", [_STABLE, stability])] if stable else []),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Use it", [Code(f"finger3d press {scene} --out {folder / 'pressed'}")]),
        ],
        [Figure("identify.png", "Measured points over the fitted scene, and residuals")],
        command="identify",
        notes=list(data["notes"]),
    )


_MOST_ROWS = 10  # of the table of the best designs
_NEAR_BOUND = 0.01  # distance of a value from its bound, relative to the distance of the bounds
_SENSITIVITY = (
    "The sensitivity is the least slope of strain against mu over all mu, divided by the noise of a strain reading; "
    "its reciprocal is the resolution of mu. It is negative if strain is not monotonic, so that two values of mu have "
    "the same strain."
)


def optimise_page(folder: str | Path) -> Page:
    """Return the page of a design search, from the files in its folder.

    Raises
    ------
    Finger3dError
        If design.json or search.json cannot be read.
    """
    folder = Path(folder)
    found, search = read_json(folder / "design.json"), read_json(folder / "search.json")
    rows = read_rows(folder / "evaluations.csv")
    good = sorted((r for r in rows if r["outcome"] == "converged"), key=lambda r: -float(r["objective"]))
    bounds = {key: (low, high) for key, low, high in search["free"]}
    increments = found.get("increments") or {}
    headline = [
        HeadlineRow("objective (sensitivity)", found["best"]),
        HeadlineRow("objective at the start", "none" if found["start"] is None else found["start"]),
        *(HeadlineRow(key, value) for key, value in found["values"].items()),
        HeadlineRow("designs evaluated", str(len(rows))),
        HeadlineRow("bodies condensed", str(found["bodies"])),
    ]
    if steps := increments.get("steps"):
        name = f"error of the strain with {', '.join(map(str, steps))} increments"
        headline.append(HeadlineRow(name, f"{increments.get('strain_error') or math.nan:.2g}"))
    free = [
        (key, *bounds[key], found["start_values"][key], value, _at_a_bound(value, *bounds[key]))
        for key, value in found["values"].items()
    ]
    best = [tuple(float(r[k]) for k in (*bounds, "objective")) for r in good[:_MOST_ROWS]]
    without = len(rows) - len(good)
    failures = [f"{without} of {len(rows)} designs have no number; evaluations.csv has the reasons."] if without else []
    best_scene = folder / "best.toml"
    command = Code(f"finger3d press {best_scene} --out {folder / 'pressed'}")
    return Page(
        f"{title_of(search['scene'])}: design for sensitivity",
        headline,
        [
            PageSection("Free keys", [_SENSITIVITY, Table(("key", "from", "to", "start", "best", ""), free)]),
            PageSection("The best designs", [*failures, Table((*bounds, "objective"), best)]),
            PageSection("Use it", [command, Code(best_scene.read_text(encoding="utf-8"), "best.toml")]),
        ],
        [Figure("design.png", "Convergence of the search, and the objective against each free key")],
        command="optimise",
        outcome=f"{len(good)} of {len(rows)} designs have a number",
        good=bool(good),
    )


def _at_a_bound(value: float, low: float, high: float) -> str:
    near = _NEAR_BOUND * (high - low)
    return "at its bound; a wider range may hold a better design" if min(value - low, high - value) < near else ""


def gauge_places_page(folder: str | Path) -> Page:
    """Return the page of placed gauges, from the files in its folder.

    Raises
    ------
    Finger3dError
        If gauges.json cannot be read.
    """
    folder = Path(folder)
    data = read_json(folder / "gauges.json")
    gauges, names = data["gauges"], ",".join(g["name"] for g in data["gauges"])
    known = list(zip(data["mu"], data["mu_sd"], strict=True))
    unknown = (data["mu"][-1] - data["mu"][0]) / math.sqrt(12.0)  # standard deviation of a mu of which nothing is known
    told = [mu for mu, _ in itertools.takewhile(lambda one: one[1] <= 0.5 * unknown, known)]
    headline = [
        HeadlineRow(f"mu \u00b1, mean over mu = {data['mu'][0]:g} to {data['mu'][-1]:g}", f"{data['mean_mu_sd']:.3g}"),
        HeadlineRow("readings tell mu", f"up to {told[-1]:.2g}" if told else "nowhere"),
    ]
    for g in gauges:
        place = f"x {g['x_mm']:.1f}, y {g['y_mm']:.1f}, z {g['z_mm']:.1f} mm, {g['angle_deg']:.1f}\u00b0"
        headline.append(HeadlineRow(g["name"], place))
    keys = "name", "x_mm", "y_mm", "z_mm", "angle_deg", "mean_mu_sd_alone", "mean_mu_sd_with_those_before"
    head = "gauge", "x (mm)", "y (mm)", "z (mm)", "angle (degree)", "mean sd of mu alone", "with those before"
    each = Table(head, [[g[key] for key in keys] for g in gauges])
    spread = Table(("mu", "sd of mu"), known)
    best = folder / "best.toml"
    return Page(
        f"{title_of(data['scene'])}: places of {len(gauges)} gauge{'s' if len(gauges) > 1 else ''}",
        headline,
        [
            PageSection("Gauges", [each]),
            PageSection("Standard deviation of mu", [spread]),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Use it", [Code(f"finger3d calibrate {best} --gauge {names} --out {folder / 'calibration'}")]),
        ],
        [Figure("map.png", "Mean standard deviation of mu with a gauge at each place, in its best direction")],
        command="optimise",
    )


_MOST_SWEEP_ROWS = 500  # of the table of points
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
    bodies = HeadlineRow("bodies", str(len(data["bodies"])))
    headline = [HeadlineRow("points", f"{len(rows)} of {data['points']}"), bodies]
    if forces:
        headline.append(HeadlineRow("normal force", f"{min(forces):.4g} to {max(forces):.4g}", "N"))
    cut = f"The first {_MOST_SWEEP_ROWS} of {len(rows)} points; all are in results.csv."
    more = [cut] if len(rows) > _MOST_SWEEP_ROWS else []
    is_list = data.get("list", False)
    varied = [(key, _values(values, is_list)) for key, values in data["vary"].items()]
    return Page(
        f"{title_of(data['scene'])}: sweep over {', '.join(data['vary'])}",
        headline,
        [
            PageSection("Points", [*more, points_table(folder, _MOST_SWEEP_ROWS)]),
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
