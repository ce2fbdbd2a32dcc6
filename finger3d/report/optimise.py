"""Pages of a design search, and of gauges that are placed together."""

from __future__ import annotations

import math
from pathlib import Path

from finger3d.report.build import Code, Figure, HeadlineRow, Page, PageSection, Table, how_modelled
from finger3d.results.summary import read_json, read_rows, title_of

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
    objective = Path(found["objective"]).name
    increments = found.get("increments") or {}
    headline = [
        HeadlineRow(f"objective ({objective})", found["best"]),
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
    parts = [Table((*bounds, "objective"), best)]
    without = len(rows) - len(good)
    failures = [f"{without} of {len(rows)} designs have no number; evaluations.csv has the reasons."] if without else []
    explanation = [_SENSITIVITY] if objective == "sensitivity" else []
    best_scene = folder / "best.toml"
    return Page(
        f"{title_of(search['scene'])}: design for {objective}",
        headline,
        [
            PageSection("Free keys", [*explanation, Table(("key", "from", "to", "start", "best", ""), free)]),
            PageSection("The best designs", [*failures, *parts]),
            PageSection(
                "Use it",
                [
                    Code(f"finger3d press {best_scene} --out {folder / 'pressed'}"),
                    Code(best_scene.read_text(encoding="utf-8"), "best.toml"),
                ],
            ),
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
    headline = [
        HeadlineRow(f"mu \u00b1, mean over mu = {data['mu'][0]:g} to {data['mu'][-1]:g}", f"{data['mean_mu_sd']:.3g}"),
        *(
            HeadlineRow(
                f"{g['name']}",
                f"x {g['x_mm']:.1f}, y {g['y_mm']:.1f}, z {g['z_mm']:.1f} mm, {g['angle_deg']:.1f}\u00b0",
            )
            for g in gauges
        ),
    ]
    each = Table(
        ("gauge", "x (mm)", "y (mm)", "z (mm)", "angle (degree)", "mean sd of mu alone", "with those before"),
        [
            (
                g["name"],
                g["x_mm"],
                g["y_mm"],
                g["z_mm"],
                g["angle_deg"],
                g["mean_mu_sd_alone"],
                g["mean_mu_sd_with_those_before"],
            )
            for g in gauges
        ],
    )
    spread = Table(("mu", "sd of mu"), list(zip(data["mu"], data["mu_sd"], strict=True)))
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
