"""The page of a design search, from what is in its folder."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from finger3d.report.build import Code, Figure, HeadlineRow, PageSection, Table, write_page
from finger3d.results.summary import read_json, read_rows, title_of

_MOST_ROWS = 10
_SENSITIVITY = (
    "Sensitivity: the least slope of strain against mu, over all mu, in parts of the noise of a strain reading; one "
    "over it is the resolution of mu. Below 0 the strain turns back: two mu share it."
)


def optimise_page(folder: str | Path) -> Path:
    """Write report.html of a search.

    Raises
    ------
    Finger3dError
        If there is no design.json or search.json to read, or the page cannot be written.
    """
    folder = Path(folder)
    found, search = read_json(folder / "design.json"), read_json(folder / "search.json")
    rows = read_rows(folder / "evaluations.csv")
    good = sorted((r for r in rows if r["outcome"] == "converged"), key=lambda r: -float(r["objective"]))
    bounds = {key: (low, high) for key, low, high in search["free"]}
    objective = Path(found["objective"]).name
    headline = [
        HeadlineRow(f"objective ({objective})", found["best"]),
        HeadlineRow("objective at the start", "none" if found["start"] is None else found["start"]),
        *(HeadlineRow(key, value) for key, value in found["values"].items()),
        HeadlineRow("designs judged", str(len(rows))),
        HeadlineRow("bodies condensed", str(found["bodies"])),
        *_increments(found.get("increments") or {}),
    ]
    free = [
        (key, *bounds[key], found["start_values"][key], value, _at_a_bound(value, *bounds[key]))
        for key, value in found["values"].items()
    ]
    best = [tuple(float(r[k]) for k in (*bounds, "objective")) for r in good[:_MOST_ROWS]]
    parts = [Table((*bounds, "objective"), best)]
    without = len(rows) - len(good)
    said = [f"{without} of {len(rows)} designs have no number; evaluations.csv says why."] if without else []
    told = [_SENSITIVITY] if objective == "sensitivity" else []
    best_scene = folder / "best.toml"
    return write_page(
        folder,
        f"{title_of(search['scene'])}: design for {objective}",
        headline,
        [
            PageSection("Free keys", [*told, Table(("key", "from", "to", "start", "best", ""), free)]),
            PageSection("The best designs", [*said, *parts]),
            PageSection("Use it", [Code(f"finger3d press {best_scene} --out {folder / 'pressed'}"),
                               Code(best_scene.read_text(encoding="utf-8"), "best.toml")]),
        ],
        [Figure("design.png", "The search")],
        command="optimise",
        outcome=f"{len(good)} of {len(rows)} designs have a number",
        good=bool(good),
    )  # fmt: skip


def _increments(found: Mapping[str, Any]) -> list[HeadlineRow]:
    """How many a press of the best design has, and the error that they leave."""
    if not found:
        return []
    steps = ", ".join(map(str, found["steps"]))
    return [HeadlineRow(f"error of the strain with {steps} increments", f"{found['strain_error'] or math.nan:.2g}")]


def _at_a_bound(value: float, low: float, high: float) -> str:
    near = 0.01 * (high - low)
    return "at its bound: a wider one may hold a better design" if min(value - low, high - value) < near else ""
