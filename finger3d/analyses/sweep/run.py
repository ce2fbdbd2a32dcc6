"""Sweeps: every point is pressed, bodies in parallel, and each row is stored as soon as it is known."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Sequence
from concurrent.futures import CancelledError
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.points import BodySpec, Point, Sweep
from finger3d.analyses.sweep.store import ResultStore
from finger3d.errors import MissingError
from finger3d.progress import Progress
from finger3d.report.sweep import sweep_page
from finger3d.results.journal import Row, number_in

if TYPE_CHECKING:
    from distributed import Client, Future

WAIT_S = 60.0
"""Time limit without any worker on a cluster."""

_POLL_S = 0.5
"""Interval at which the connection to the cluster is checked."""

_SHOW_S = 0.2
"""Interval of progress reports."""

_BATCH_S = 2.0
"""Time that the points sent to a worker at once should take; so much work is repeated if the worker dies."""


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
    out : folder for points.jsonl, results.parquet, results.csv and report.html; a sweep found there is continued
    scheduler : address of a Dask scheduler; None starts workers on this machine
    workers : processes on this machine; None: one for each core, at most one for each body. A single body is pressed
        by this process.
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
        progress = _SweepProgress(store, report)
        try:
            _press(store, scheduler, workers, progress)
        finally:
            store.reload()
            progress.report.steps_done = len(store.rows)
            store.write()
        with store.room("report.html"):
            sweep_page(folder)
        return store


class _SweepProgress:
    """Stores rows, and reports how many points are finished and how long the others will take."""

    def __init__(self, store: ResultStore, report: Progress) -> None:
        self.store, self.report = store, report
        self._before, self._failed = len(store.rows), 0
        self._start = self._shown = time.monotonic()
        report.steps_done, report.steps_total = self._before, len(store.sweep.points)
        if self._before:
            report.say(f"{self._before} of {report.steps_total} points are kept from an earlier run")

    def add(self, row: Row) -> None:
        """Store the row of a finished point."""
        self.store.add(row)
        self._failed += row["outcome"] != "converged"
        done, total, now = len(self.store.rows), self.report.steps_total, time.monotonic()
        self.report.steps_done = done
        if done == total or now - self._shown > _SHOW_S:
            self._shown = now
            left = duration((total - done) * (now - self._start) / (done - self._before))
            self.report.step(
                done, total, f"about {left} left" + f", {self._failed} without numbers" * bool(self._failed)
            )


@dataclass
class _BodyPoints:
    """The points of a body that are not pressed yet, and how many of them the next batch has."""

    spec: BodySpec
    left: list[Point]
    size: int = 1

    def advance(self, rows: Sequence[Row]) -> None:
        """Remove the points that have a row now, and let the next batch take `_BATCH_S`."""
        done = {row["point"] for row in rows}
        self.left = [point for point in self.left if point.number not in done]
        seconds = sum(number_in(row, "seconds") for row in rows) / len(rows)
        if seconds > 0.0:  # NaN if a point failed
            self.size = max(1, int(_BATCH_S / seconds))


def _press(store: ResultStore, scheduler: str | None, workers: int | None, progress: _SweepProgress) -> None:
    """Press the points that are left: those of a single body in this process, others on a cluster."""
    bodies = _bodies(store)
    if bodies and (scheduler or len(bodies) > 1):
        progress.report.stage("starting workers" if scheduler is None else f"connecting to {scheduler}")
        with _cluster(scheduler, workers, len(bodies)) as client:
            _Cluster(client, progress).press(bodies)
    elif bodies:
        progress.report.stage("pressing")
        for row in worker.rows(bodies[0].spec, bodies[0].left):
            progress.add(row)


def _bodies(store: ResultStore) -> list[_BodyPoints]:
    """Return the bodies with unfinished points, those with most points first."""
    members: dict[str, list[Point]] = {}
    for point in store.left():
        members.setdefault(point.body, []).append(point)
    found = [_BodyPoints(store.sweep.bodies[key], points) for key, points in members.items()]
    return sorted(found, key=lambda body: -len(body.left))


def _cluster(scheduler: str | None, workers: int | None, bodies: int) -> AbstractContextManager[Client]:
    from finger3d.analyses.sweep import cluster

    if scheduler is not None:
        return cluster.remote(scheduler)
    return cluster.local(workers or cluster.default_workers(bodies))


class _Cluster:
    """Presses on a Dask cluster: as many bodies at a time as there are workers, one batch of points after another."""

    def __init__(self, client: Client, progress: _SweepProgress) -> None:
        self.client, self.progress = client, progress
        self._running: dict[Future[list[Row]], _BodyPoints] = {}
        self._finished: SimpleQueue[Future[list[Row]]] = SimpleQueue()
        self._seen = time.monotonic()

    def press(self, bodies: Sequence[_BodyPoints]) -> None:
        """Press all points of some bodies.

        Raises
        ------
        MissingError
            If the scheduler cannot be reached any more, or no worker is left.
        """
        self.progress.report.stage("pressing")
        waiting = deque(bodies)
        try:
            while waiting or self._running:
                while waiting and len(self._running) < max(1, self._workers()):
                    self._submit(waiting.popleft())
                self._receive()
        except (OSError, CancelledError):  # of the connection; a file that cannot be written raises a Finger3dError
            raise self._lost("scheduler") from None
        finally:
            if self._running and self.client.status == "running":
                self.client.cancel(list(self._running), force=True)

    def _submit(self, body: _BodyPoints, address: str | None = None) -> None:
        """Send the next batch of a body, to the worker that has condensed it if that is still there."""
        future = self.client.submit(
            worker.batch,
            body.spec,
            body.left,
            body.size,
            pure=False,
            workers=address and [address],
            allow_other_workers=address is not None,
        )
        self._running[future] = body
        future.add_done_callback(self._finished.put)

    def _receive(self) -> None:
        """Store the rows of one batch, and send the next one of its body."""
        if self.client.status != "running":  # which cancels every future
            raise self._lost("scheduler")
        try:
            future = self._finished.get(timeout=_POLL_S)
        except Empty:
            self._workers()
            return
        body = self._running.pop(future)
        if future.status != "finished":
            self._give_up(body, _reason(future))
            return
        address = next(iter(self.client.who_has([future]).get(future.key, ())), None)
        rows: list[Row] = future.result()
        for row in rows:
            self.progress.add(row)
        body.advance(rows)
        if body.left:
            self._submit(body, address)

    def _give_up(self, body: _BodyPoints, reason: str) -> None:
        if self.client.status != "running":  # a lost connection cancels every future
            raise self._lost("scheduler")
        for point in body.left:
            self.progress.store.lose(point, reason)
        self.progress.report.say(f"{len(body.left)} points lost: {reason}")

    def _workers(self) -> int:
        """Return the number of workers.

        Raises
        ------
        MissingError
            If there has been none for `WAIT_S`.
        """
        count, now = len(self.client.nthreads()), time.monotonic()
        if count:
            self._seen = now
        elif now - self._seen > WAIT_S:
            raise self._lost("worker")
        return count

    def _lost(self, what: str) -> MissingError:
        return MissingError(f"sweep: no {what} is left; {self.progress.store.said()}; run the same command again")


def _reason(future: Future[list[Row]]) -> str:
    """Return in one line why a batch has no result."""
    from distributed import KilledWorker

    error = future.exception() if future.status == "error" else None
    if isinstance(error, KilledWorker):
        return (
            "every worker that was given this body died, perhaps for lack of memory; "
            "try a coarser mesh or fewer --workers; the same command tries it again"
        )
    if error is None:
        return "its task was cancelled; the same command tries it again"
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def duration(seconds: float) -> str:
    """Return a short text such as "12 s", "3 min" or "1.5 h"."""
    if seconds < 90.0:
        return f"{math.ceil(seconds)} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
