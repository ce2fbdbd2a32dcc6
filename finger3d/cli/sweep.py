"""Command ``sweep``: presses for all combinations of given values of keys."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from finger3d.cli.common import (
    Continued,
    Json,
    Set,
    Texts,
    app,
    check_writable,
    job,
    print_columns,
    print_json,
    print_rows,
)
from finger3d.errors import Finger3dError, MissingError
from finger3d.progress import Progress

if TYPE_CHECKING:
    from finger3d.analyses.sweep.store import ResultStore

_MOST_POINTS, _MOST_GAUGES = 10, 3  # in the printed table


@dataclass(frozen=True, kw_only=True)
class SweepOptions:
    """Which points are pressed, and where.

    Parameters
    ----------
    vary
        A key and its values, for instance friction.mu=0.06,0.25,1; may be repeated.
    points
        CSV file with a column for each key and a row for each point, instead of --vary.
    sample
        Points within --range, instead of --vary: lhs:200 (Latin hypercube) or random:200.
    range
        A key and its bounds, as friction.mu=0.05:1; may be repeated.
    seed
        Of the random numbers of --sample.
    scheduler
        Address of a Dask scheduler that runs the presses, instead of processes here.
    workers
        Number of processes on this machine; default: one for each core, none for a single body.
    """

    vary: Texts | None = None
    points: Path | None = None
    sample: str | None = None
    range: Texts | None = None
    seed: int = 0
    scheduler: str | None = None
    workers: int | None = None

    def check(self) -> None:
        """Raise a Finger3dError for options that contradict each other."""
        if self.workers is not None and self.workers < 1:
            raise Finger3dError(f"--workers {self.workers}: must be at least 1")
        if self.workers is not None and self.scheduler is not None:
            raise Finger3dError("--workers and --scheduler: give one of them; a cluster has its own workers")
        if sum(given is not None for given in (self.vary, self.points, self.sample)) != 1:
            raise Finger3dError(
                "sweep: give one of --vary, --points and --sample, for instance --vary friction.mu=0.06,0.25,1"
            )
        if self.range is not None and self.sample is None:
            raise Finger3dError("--range: only with --sample, for instance --sample lhs:200")
        if self.sample == "grid":
            raise Finger3dError("--sample grid: must be lhs:NUMBER or random:NUMBER; --vary gives a grid")


@app.command
def sweep(
    scene: Path,
    /,
    *,
    out: Continued,
    options: Annotated[SweepOptions, Parameter(name="*")] = SweepOptions(),
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Press many points in parallel; the same command continues after an interruption.

    The points are all combinations of given values, the rows of a table, or random samples within ranges. Values of
    friction, depths, slides, steps and gauges share one condensed body; other keys need one for each value.

    Example: finger3d sweep scene.toml --vary friction.mu=0.06,0.25,1 --vary gauge.g36.angle_deg=15,30,45 --out out

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    options.check()
    from finger3d.analyses.sweep.run import sweep as run

    check_writable(out, scene)
    given = options.points or (options.vary if options.sample is None else options.range) or ()
    where, sample = (options.scheduler, options.workers), options.sample or "grid"
    with job(json_, lambda done: _kept(done, out)) as report:
        store = run(scene, given, out, set_ or (), *where, report, sample, options.seed).store
    points = _points(store)
    if json_:
        kept, bodies = len(store.rows), len(store.sweep.bodies)
        without = sum(row["outcome"] != "converged" for row in points)
        counts = {"points": len(store.sweep.points), "kept": kept, "failed": without, "bodies": bodies}
        print_json({"results": out, **counts, "rows": points})
    else:
        _print_points(store, points)
        print_rows(store.sweep.title, _rows(store, out))
    failed = [row for row in (store.rows | store.lost).values() if row["outcome"] != "converged"]
    if failed:
        raise MissingError(
            f"{scene}: {len(failed)} of {len(store.sweep.points)} points gave no numbers, "
            f"the first: {failed[0]['outcome']}"
        )


def _kept(done: Progress, out: Path) -> str:
    if not done.steps_done:
        return "no point was finished"
    return f"{done.steps_done} of {done.steps_total} points are kept in {out}; the same command continues"


def _points(store: ResultStore) -> list[dict[str, object]]:
    """Return the rows of results.csv."""
    columns = store.columns()
    return [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]


def _print_points(store: ResultStore, points: Sequence[Mapping[str, object]]) -> None:
    """Print the varied keys and the main numbers of the first points."""
    from finger3d.mechanics.readings.columns import MAIN
    from finger3d.report.build import number
    from finger3d.results.summary import strains_of

    def cell(value: object) -> str:
        return "" if isinstance(value, float) and math.isnan(value) else number(value)

    if not points:
        return
    gauges = [c.key for c in strains_of(store.sweep.given) if c.key in points[0]][:_MOST_GAUGES]
    head = [*(v.key for v in store.sweep.vary), *(name for name in (*MAIN, *gauges, "outcome") if name in points[0])]
    print_columns(head, ([cell(row[name]) for name in head] for row in points[:_MOST_POINTS]))
    if len(points) > _MOST_POINTS:
        print(f"  the first {_MOST_POINTS} of {len(points)} points; all are in results.csv")


def _rows(store: ResultStore, out: Path) -> list[tuple[str, str]]:
    from finger3d.results.journal import number_in

    solved = [row for row in store.rows.values() if "seconds" in row]
    seconds = sum(number_in(row, "seconds") for row in solved)
    built = {row["body"]: number_in(row, "build_seconds") for row in solved}
    return [
        ("points", f"{len(store.sweep.points)}, {len(store.rows)} of them kept"),
        ("bodies", f"{len(store.sweep.bodies)}, each condensed once"),
        ("time of workers", f"{sum(built.values()):.1f} s meshing and condensing, {seconds:.1f} s contact"),
        ("results", str(out / "results.csv")),
        *[("", str(out / name)) for name in ("results.parquet", "report.html") if (out / name).exists()],
    ]
