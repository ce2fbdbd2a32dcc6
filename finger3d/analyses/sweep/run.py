"""Sweeps: every point is pressed, bodies in parallel, and each row is stored as soon as it is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._extras import require
from finger3d._machine import cores
from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.points import Point, checked_points, drawn, rows_of, varied
from finger3d.analyses.sweep.store import BodyPoints, ResultStore, SweepProgress
from finger3d.progress import Progress
from finger3d.report.analyses import sweep_page
from finger3d.scene import Source

if TYPE_CHECKING:
    import pandas

Value = float | int | bool | str
"""Value of a key of a scene."""


@dataclass(frozen=True)
class SweepResult:
    """Rows of a sweep.

    Attributes
    ----------
    out : folder of results.csv, report.html and, with pyarrow, results.parquet
    columns : name -> a value for each point: the varied keys, the numbers of the last step with their units in the
        name, gauges, outcome
    failed : number of points without results
    store : the points and their rows
    """

    out: Path
    columns: Mapping[str, Sequence[Value]]
    failed: int
    store: ResultStore = field(repr=False)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the columns as a pandas DataFrame, one row for each point."""
        require("to_dataframe()", "pandas")
        import pandas

        return pandas.DataFrame(dict(self.columns))


def sweep(
    scene: Source,
    vary: Mapping[str, Sequence[Value]] | Sequence[str] | str | Path,
    out: str | Path,
    overrides: Sequence[str] = (),
    scheduler: str | None = None,
    workers: int | None = None,
    report: Progress | None = None,
    sample: str = "grid",
    seed: int = 0,
) -> SweepResult:
    """Press many points of a scene: every combination of some values of keys, the rows of a table, or random samples.

    A sweep that was interrupted continues in the same folder.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    vary : key -> values, for instance ``{"friction.mu": [0.06, 0.25, 1.0], "material.nu": [0.45, 0.49]}``, or texts
        such as ``"friction.mu=0.06,0.25,1"``, of samples ``"friction.mu=0.06:1"``; or the path of a CSV file with a
        column for each key and a row for each point
    out : folder for points.jsonl, results.csv, report.html and, with pyarrow, results.parquet
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    scheduler : address of a Dask scheduler; None: processes on this machine
    workers : number of these processes; None: one for each core, at most one for each body. One worker is this process,
        as for a single body.
    report : receives the progress at every point
    sample : ``"grid"``, every combination of the values; ``"lhs:200"`` or ``"random:200"``, that many samples, of a
        Latin hypercube or independent, where `vary` has the lower and the upper bound of every key
    seed : of the random numbers

    Raises
    ------
    Finger3dError
        For a mistake in the scene or the values, before any point is solved.
    MissingError
        If a file cannot be written, or the cluster is lost; finished points are kept.
    """
    report = report or Progress()
    report.stage("checking every point")
    if isinstance(vary, str | Path):
        columns, option = rows_of(Path(vary)), "--points"
    elif sample == "grid":
        columns, option = varied(_texts(vary, ",")), "--vary"
    else:
        columns, option = drawn(sample, _texts(vary, ":"), seed), "--sample"
    points = checked_points(scene, overrides, columns, option, report)
    folder = Path(out)
    if any(body.labels for body in points.bodies.values()):
        require("[labels]", "h5py")
    with ResultStore(points, folder).open() as store:
        progress = SweepProgress(store, report)
        try:
            _press(store, scheduler, workers, progress)
        finally:
            store.reload()
            report.steps_done = len(store.rows)
            store.write()
        sweep_page(folder).write(folder)
    table = store.columns()
    return SweepResult(folder, table, sum(outcome != "converged" for outcome in table["outcome"]), store)


def _texts(vary: Mapping[str, Sequence[Value]] | Sequence[str], mark: str) -> Sequence[str]:
    """Return ``KEY=VALUE,VALUE`` for every key, with `mark` between the values."""
    if not isinstance(vary, Mapping):
        return vary
    return [f"{key}={mark.join(map(_as_toml, values))}" for key, values in vary.items()]


def _as_toml(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _press(store: ResultStore, scheduler: str | None, workers: int | None, progress: SweepProgress) -> None:
    """Press the points that are left: on a cluster, in processes of this machine, or in this process."""
    bodies = _bodies(store, _MOST_PARTS if scheduler else workers or cores())
    if bodies and scheduler is not None:
        from finger3d.analyses.sweep import cluster

        progress.report.stage(f"connecting to {scheduler}")
        with cluster.remote(scheduler) as client:
            cluster.Cluster(client, progress).press(bodies)
    elif len(bodies) > 1 and workers != 1:
        from finger3d.analyses.sweep import local

        progress.report.stage("pressing")
        local.press(bodies, progress, workers or min(cores(), len(bodies)))
    else:
        progress.report.stage("pressing")
        for body in bodies:
            for row in worker.rows(body.spec, body.left):
                progress.add(row)


_MOST_PARTS, _PART = 64, 20
"""Most parts that the points of a body with labels are pressed in on a cluster, and least points of a part."""


def _bodies(store: ResultStore, parts: int) -> list[BodyPoints]:
    """Return the bodies with unfinished points, those with most points first.

    A body with labels has many points; they are divided among workers, each of which condenses it.
    """
    members: dict[str, list[Point]] = {}
    for point in store.left():
        members.setdefault(point.body, []).append(point)
    found = []
    for key, points in members.items():
        spec = store.sweep.bodies[key]
        count = max(1, min(parts, len(points) // _PART)) if spec.labels else 1
        found += [BodyPoints(spec, points[k::count]) for k in range(count)]
    return sorted(found, key=lambda body: -len(body.left))
