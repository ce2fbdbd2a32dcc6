"""Command ``sweep``: presses for all combinations of given values of keys."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import app, job
from finger3d.cli.options import Continued, Json, Set
from finger3d.cli.printing import print_columns, print_json, print_page
from finger3d.cli.sweep_options import SweepOptions
from finger3d.errors import MissingError
from finger3d.progress import Progress

_MOST_POINTS = 10  # in the printed table
_FILES = "results.csv", "results.parquet", "labels.h5", "report.html"


@app.command
def sweep(
    scene: Path,
    /,
    *,
    out: Continued,
    options: Annotated[SweepOptions | None, Parameter(name="*")] = None,
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
    options = options or SweepOptions()
    options.check()
    from finger3d.analyses.sweep.run import sweep as run
    from finger3d.report.analyses import points_table, sweep_page
    from finger3d.report.build import number

    def kept(done: Progress) -> str:
        if not done.steps_done:
            return "no point was finished"
        return f"{done.steps_done} of {done.steps_total} points are kept in {out}; the same command continues"

    from finger3d.io import check_writable

    check_writable(out, scene)
    given = options.points or (options.vary if options.sample is None else options.range) or ()
    where, sample = (options.scheduler, options.workers), options.sample or "grid"
    with job(json_, kept) as report:
        store = run(scene, given, out, set_ or (), *where, report, sample, options.seed).store
    if json_:
        print_json(store.as_dict())
    else:
        table = points_table(out, _MOST_POINTS)
        print_columns(table.head, ([number(cell) for cell in row] for row in table.rows))
        if len(store.rows) > _MOST_POINTS:
            print(f"  the first {_MOST_POINTS} of {len(store.rows)} points; all are in results.csv")
        print_page(sweep_page(out), (out / name for name in _FILES if (out / name).exists()))
    failed = [row for row in (store.rows | store.lost).values() if row["outcome"] != "converged"]
    if failed:
        raise MissingError(
            f"{scene}: {len(failed)} of {len(store.sweep.points)} points gave no numbers, "
            f"the first: {failed[0]['outcome']}"
        )
