"""Sweeps: every point is pressed, bodies in parallel, and each row is stored as soon as it is known."""

from __future__ import annotations

from pathlib import Path

from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.points import Point, Sweep
from finger3d.analyses.sweep.progress import BodyPoints, SweepProgress
from finger3d.analyses.sweep.store import ResultStore
from finger3d.progress import Progress
from finger3d.report.sweep import sweep_page


def sweep(
    points: Sweep,
    out: str | Path,
    scheduler: str | None = None,
    workers: int | None = None,
    report: Progress | None = None,
) -> ResultStore:
    """Press every point of a sweep that has no row yet.

    Parameters
    ----------
    points : from `finger3d.analyses.sweep.points.combinations`
    out : folder for points.jsonl, results.csv, report.html and, with pyarrow, results.parquet; a sweep found there is
        continued
    scheduler : address of a Dask scheduler; None starts workers on this machine
    workers : processes on this machine; None: one for each core, at most one for each body. One worker is this process,
        as for a single body.
    report : shows the progress

    Returns
    -------
    ResultStore
        The rows by point, and why other points have none.

    Raises
    ------
    Finger3dError
        If the folder holds another sweep.
    MissingError
        If a file cannot be written, or the cluster is lost; finished points are kept.
    """
    report = report or Progress()
    folder = Path(out)
    with ResultStore(points, folder).open() as store:
        progress = SweepProgress(store, report)
        try:
            _press(store, scheduler, workers, progress)
        finally:
            store.reload()
            progress.report.steps_done = len(store.rows)
            store.write()
        with store.room("report.html"):
            sweep_page(folder)
        return store


def _press(store: ResultStore, scheduler: str | None, workers: int | None, progress: SweepProgress) -> None:
    """Press the points that are left: on a cluster, in processes of this machine, or in this process."""
    bodies = _bodies(store)
    if bodies and scheduler is not None:
        from finger3d.analyses.sweep import cluster

        progress.report.stage(f"connecting to {scheduler}")
        with cluster.remote(scheduler) as client:
            cluster.Cluster(client, progress).press(bodies)
    elif len(bodies) > 1 and workers != 1:
        from finger3d.analyses.sweep import local

        progress.report.stage("pressing")
        local.press(bodies, progress, workers or local.default_workers(len(bodies)))
    else:
        progress.report.stage("pressing")
        for body in bodies:
            for row in worker.rows(body.spec, body.left):
                progress.add(row)


def _bodies(store: ResultStore) -> list[BodyPoints]:
    """Return the bodies with unfinished points, those with most points first."""
    members: dict[str, list[Point]] = {}
    for point in store.left():
        members.setdefault(point.body, []).append(point)
    found = [BodyPoints(store.sweep.bodies[key], points) for key, points in members.items()]
    return sorted(found, key=lambda body: -len(body.left))
