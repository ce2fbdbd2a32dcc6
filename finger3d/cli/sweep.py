"""sweep: every combination of some values of a scene's keys."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from finger3d.cli.common import (
    Json,
    Set,
    app,
    check_writable,
    complain,
    print_columns,
    print_json,
    print_rows,
    reporting,
)
from finger3d.errors import Finger3dError, MissingError

if TYPE_CHECKING:
    from finger3d.analyses.sweep.store import ResultStore

_SHOWN, _GAUGES = 10, 3  # points and gauges


@app.command
def sweep(
    scene: Path,
    /,
    *,
    vary: Annotated[
        list[str],
        Parameter(negative=(), help="A key and its values, for instance friction.mu=0.06,0.25,1; may be repeated."),
    ],
    out: Annotated[Path, Parameter(help="Folder for the results; that of the same sweep is gone on with.")],
    set_: Set = None,
    scheduler: Annotated[str | None, Parameter(help="Address of a Dask scheduler, instead of processes here.")] = None,
    workers: Annotated[
        int | None,
        Parameter(help="Processes on this machine; default one for each core, and none beside this one for one body."),
    ] = None,
    json_: Json = False,
) -> int:
    """Press every combination of some values, in parallel; the same command goes on after an interruption.

    Friction, depths, slides, steps and gauges share one condensation; every other key needs one for each value.

    Example: finger3d sweep scene.toml --vary friction.mu=0.06,0.25,1 --vary gauge.g36.angle_deg=15,30,45 --out out

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    if workers is not None and workers < 1:
        raise Finger3dError(f"--workers {workers}: must be at least 1")
    if workers is not None and scheduler is not None:
        raise Finger3dError("--workers and --scheduler: give one of them; a cluster has its own workers")
    from finger3d.analyses.sweep.points import combinations
    from finger3d.analyses.sweep.run import sweep as run

    report, aside = reporting(json_)
    try:
        with aside, report:
            report.stage("checking every point")
            points = combinations(scene, set_ or [], vary)
            check_writable(out, scene)
            kept = run(points, out, scheduler, workers, report)
        _tell(kept, out, json_)
    except KeyboardInterrupt:
        complain(f"interrupted; {_said(report.steps_done, report.steps_total, out)}")
        return 130
    failed = [row for row in (kept.rows | kept.lost).values() if row["outcome"] != "converged"]
    if not failed:
        return 0
    complain(
        f"{scene}: {len(failed)} of {len(points.points)} points gave no numbers, the first: {failed[0]['outcome']}"
    )
    return MissingError.exit_code


def _tell(kept: ResultStore, out: Path, json_: bool) -> None:
    if json_:
        print_json(_as_dict(kept, out))
    else:
        _print_points(kept)
        print_rows(kept.sweep.title, _rows(kept, out))


def _said(done: int, total: int, out: Path) -> str:
    return f"{done} of {total} points are kept in {out}; the same command goes on" if done else "no point was finished"


def _points(kept: ResultStore) -> list[dict[str, Any]]:
    """Every point as a row of the table in the results."""
    columns = kept.columns()
    return [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]


def _as_dict(kept: ResultStore, out: Path) -> dict[str, Any]:
    points = _points(kept)
    failed = sum(row["outcome"] != "converged" for row in points)
    return {
        "results": out, "points": len(kept.sweep.points), "kept": len(kept.rows), "failed": failed,
        "bodies": len(kept.sweep.bodies), "rows": points,
    }  # fmt: skip


def _print_points(kept: ResultStore) -> None:
    """The varied keys and the main numbers of the first points."""
    from finger3d.io import MAIN
    from finger3d.report.build import number

    def cell(value: Any) -> str:
        return "" if isinstance(value, float) and math.isnan(value) else number(value)

    points = _points(kept)
    if not points:
        return
    gauges = [name for name in points[0] if name.startswith("gauge_")][:_GAUGES]
    head = [*(v.key for v in kept.sweep.vary), *(name for name in (*MAIN, *gauges, "outcome") if name in points[0])]
    print_columns(head, ([cell(row[name]) for name in head] for row in points[:_SHOWN]))
    if len(points) > _SHOWN:
        print(f"  the first {_SHOWN} of {len(points)} points; all are in results.csv")


def _rows(kept: ResultStore, out: Path) -> list[tuple[str, str]]:
    from finger3d.results.journal import number_in

    solved = [row for row in kept.rows.values() if "seconds" in row]
    seconds = sum(number_in(row, "seconds") for row in solved)
    built = {row["body"]: number_in(row, "build_seconds") for row in solved}
    return [
        ("points", f"{len(kept.sweep.points)}, of them {len(kept.rows)} kept"),
        ("bodies", f"{len(kept.sweep.bodies)}, each condensed once"),
        ("time of workers", f"{sum(built.values()):.1f} s meshing and condensing, {seconds:.1f} s contact"),
        ("results", str(out / "results.csv")),
        ("", str(out / "results.parquet")),
        ("", str(out / "report.html")),
    ]
