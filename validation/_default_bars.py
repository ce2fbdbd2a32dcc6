"""Are the numbers of a press on the default mesh of use: has at most one in twenty a bar above a quarter of its value?

No source.  The scenes of geometries/ as they are, and random sections and solids without ``[mesh]``: four designs under
planes, bars and balls, 2 to 15 % of their height deep, nu from 0.3 to 0.49, mu from 0.06 to 1, with a gauge.  All
numbers that have error bars count, relative as finger3d.accuracy.error_bars.relative_error has it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from finger3d.accuracy.error_bars import ErrorBars, relative_error
from finger3d.analyses.press import press
from finger3d.mechanics.history import table_row
from finger3d.mechanics.readings import kinds_of

from ._press import GEOMETRIES
from ._rows import Result, Row, at_most, columns, words

COUNTS = {"plane-strain": 12, "plane-stress": 6, "solid": 12}
SHARE, QUARTER = 0.05, 0.25
FIG9 = {"stick_area_mm2": 0.12, "stick_half_length_mm": 0.12, "gauge_g36": 0.02}
READINGS = ("gauge", "marker", "taxel")
DESIGNS = {
    "half_cylinder": (8.0, {"radius_mm": 8.0, "width_mm": 10.0}),
    "clipped_cylinder": (16.0, {"radius_mm": 30.0, "half_length_mm": 15.0, "edge_height_mm": 12.0, "width_mm": 10.0}),
    "block": (10.0, {"half_length_mm": 10.0, "height_mm": 10.0, "width_mm": 12.0}),
    "hemisphere": (8.0, {"radius_mm": 8.0}),
}


class Number(NamedTuple):
    """One number of a press with its bar."""

    scene: str
    domain: str
    name: str
    value: float
    bar: float
    relative: float
    seconds: float


def random_scenes(quick: bool) -> Iterator[tuple[str, dict[str, Any]]]:
    """Scenes without a mesh of their own."""
    random = np.random.default_rng(20261126)
    for domain, count in COUNTS.items():
        for k in range(min(count, 2 if domain == "plane-strain" else 0) if quick else count):
            names = list(DESIGNS)[: 3 if domain != "solid" else 4]
            name = names[random.integers(len(names))]
            height, sizes = DESIGNS[name]
            objects: list[dict[str, Any]] = [{"shape": "cylinder", "radius_mm": random.uniform(0.5, 4.0) * height}]
            if name != "block":
                objects += [{"shape": "plane"}, {"shape": "plane"}]
            if domain == "solid":
                objects.append({"shape": "sphere", "radius_mm": random.uniform(0.5, 4.0) * height})
            yield (
                f"{domain} {k}, {name.replace('_', ' ')}",
                {
                    "finger": {"geometry": name, **sizes},
                    "material": {"E_MPa": 1.0, "nu": random.uniform(0.3, 0.49)},
                    "friction": {"mu": float(np.exp(random.uniform(np.log(0.06), 0.0)))},
                    "press": {"depth_mm": random.uniform(0.02, 0.15) * height},
                    "object": objects[random.integers(len(objects))],
                    "model": {"domain": domain},
                    "gauge": [{"name": "g", "x_mm": 0.2 * height, "y_mm": 0.7 * height, "angle_deg": 30.0}],
                },
            )


def numbers(title: str, scene: Path | dict[str, Any]) -> Iterator[Number]:
    """All numbers of a press that have bars."""
    begin = time.perf_counter()
    result = press(scene)
    seconds = time.perf_counter() - begin
    summary, last = result.summary(), result.history.steps[-1]
    kinds = kinds_of(last.readings)
    values = {name: value for name, value in table_row(result.history.points, last).items() if name in kinds}
    for name, bar in ErrorBars.of_summary(summary).totals().items():
        relative = relative_error(values, kinds, name, bar)
        yield Number(title, summary["scene"]["model"]["domain"], name, float(values[name]), bar, relative, seconds)


def run(quick: bool) -> Result:
    """Quick: two random sections."""
    named: list[tuple[str, Any]] = [] if quick else [(path.stem, path) for path in sorted(GEOMETRIES.glob("*.toml"))]
    found = [one for title, scene in (*named, *random_scenes(quick)) for one in numbers(title, scene)]
    rows = list(_rows(found, {title for title, _ in named}))
    table = columns(" ".join(Number._fields), found)
    return Result(tuple(rows), table, lambda figure: _draw(figure, found))


def _rows(found: list[Number], named: set[str]) -> Iterator[Row]:
    groups = {
        "scenes of geometries/": [n for n in found if n.scene in named],
        "random sections": [n for n in found if n.scene not in named and n.domain != "solid"],
        "random solids": [n for n in found if n.scene not in named and n.domain == "solid"],
    }
    for what, some in groups.items():
        if some:
            share = float(np.mean([n.relative > QUARTER for n in some]))
            yield at_most(f"share of {len(some)} numbers with a bar above a quarter, {what}", "goal of this project",
                          SHARE, share, "one in twenty", "statement")  # fmt: skip
    for n in found:
        if n.scene == "fig9" and n.name in FIG9:
            yield at_most(f"bar over {n.name}, fig9", "goal of this project", FIG9[n.name], n.relative, "of use",
                          "statement")  # fmt: skip


def _draw(figure: Any, found: list[Number]) -> None:
    axes = figure.subplots()
    some = [n for n in found if 0.0 < n.relative < np.inf]
    kinds = ["readings" if n.name.startswith(READINGS) else words(n.name) for n in some]
    names = sorted(set(kinds))
    figure.set_size_inches(8.0, 0.3 * len(names) + 1.6)
    for colour, domains, label in (("C0", ("plane-strain", "plane-stress"), "sections"), ("C1", ("solid",), "solids")):
        own = [(100.0 * n.relative, names.index(k)) for n, k in zip(some, kinds, strict=True) if n.domain in domains]
        x, y = np.array(own).reshape(-1, 2).T
        axes.plot(x, y + (0.15 if label == "solids" else -0.15), "|", color=colour, ms=8, label=label)
    axes.axvline(100.0 * QUARTER, color="k", lw=0.8, ls=":", label="a quarter of the number")
    axes.set(xscale="log", xlabel="error bar, % of the number", yticks=range(len(names)), yticklabels=names)
    axes.set(xlim=(1e-3, 3e2), ylim=(len(names) - 0.5, -0.5))
