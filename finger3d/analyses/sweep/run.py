"""A sweep from its points to its tables: bodies go to workers, rows are kept as they come."""

from __future__ import annotations

import math
import queue
import time
import uuid
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any

from finger3d.analyses.sweep import cluster
from finger3d.analyses.sweep.points import Sweep
from finger3d.analyses.sweep.store import ResultStore
from finger3d.analyses.sweep.worker import Task, on_worker, press_all
from finger3d.errors import Finger3dError, MissingError
from finger3d.progress import Progress
from finger3d.report.sweep import sweep_page

WAIT_S = 60.0
"""How long a sweep goes on waiting without any worker."""

_LOOK_S, _SHOW_S = 0.5, 0.2


def sweep(
    points: Sweep,
    out: str | Path,
    scheduler: str | None = None,
    workers: int | None = None,
    report: Progress | None = None,
) -> ResultStore:
    """Press every point of a sweep that is not kept yet.

    Parameters
    ----------
    points : from `finger3d.analyses.sweep.points.combinations`
    out : folder for points.jsonl, results.parquet, results.csv and report.html; that of the same sweep is gone on with
    scheduler : address of a Dask scheduler; None starts workers on this machine
    workers : processes on this machine; None: one for each core, at most one for each body; a single body is pressed
        by this process
    report : told about every point

    Returns
    -------
    Kept
        The rows: kept ones by number, and those lost with their worker, which the next run tries again.

    Raises
    ------
    Finger3dError
        If the folder holds another sweep.
    MissingError
        If a file cannot be written, or the cluster is gone; what is finished is kept.
    """
    report = report or Progress()
    folder = Path(out)
    with ResultStore(points, folder).open() as kept:
        report.steps_done, report.steps_total = len(kept.rows), len(points.points)
        if before := len(kept.rows):
            report.say(f"{before} of {len(points.points)} points are kept from before")
        try:
            _press(kept, _tasks(points, kept), scheduler, workers, report)
        except BaseException:
            # what ended the run is the news; tables that cannot be written beside it are not
            with suppress(Finger3dError):
                kept.write()
            raise
        kept.write()
        with kept.room("report.html"):
            sweep_page(folder)
        return kept


def _press(kept: ResultStore, tasks: list[Task], scheduler: str | None, workers: int | None, report: Progress) -> None:
    """Press what is left: a single body in this process, several, or any on a cluster, by workers."""
    if len(tasks) > 1 or (tasks and scheduler):
        with _cluster(scheduler, workers, len(tasks), report) as client:
            _Run(client, kept, tasks, report).go()
    elif tasks:
        _Run(None, kept, tasks, report).here()


def _cluster(scheduler: str | None, workers: int | None, bodies: int, report: Progress) -> AbstractContextManager[Any]:
    report.stage("starting workers" if scheduler is None else f"connecting to {scheduler}")
    return cluster.local(workers or cluster.default_workers(bodies)) if scheduler is None else cluster.remote(scheduler)


def _tasks(points: Sweep, kept: ResultStore) -> list[Task]:
    """A body with its points that are left, the largest first: they end the run last."""
    members: dict[str, list[Any]] = {}
    for number in kept.left():
        point = points.points[number]
        members.setdefault(point.body, []).append((number, point.variant))
    return sorted(((key, points.bodies[key], of) for key, of in members.items()), key=lambda task: -len(task[2]))


class _Run:
    """Bodies on their way: rows and ends arrive in one queue, filled by the client's own thread."""

    def __init__(self, client: Any, kept: ResultStore, tasks: list[Task], report: Progress) -> None:
        self.client, self.kept, self.report = client, kept, report
        self.arrived: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.name = f"finger3d-sweep-{uuid.uuid4().hex[:12]}"
        self.tasks = {self._topic(task[0]): task for task in tasks}
        self.started = self._seen = time.monotonic()
        self._shown = -math.inf
        self.new = 0

    def _topic(self, body: str) -> str:
        return f"{self.name}-{body}"

    def here(self) -> None:
        """Press all bodies in this process, with its threads, and keep the rows."""
        self.report.stage("pressing")
        for task in self.tasks.values():
            press_all(task, self._row, threads=None)

    def go(self) -> None:
        """Submit all bodies, and keep what arrives until none is left.

        Raises
        ------
        MissingError
            If the scheduler cannot be reached any more, or no worker is left.
        """
        self.report.stage("pressing")
        try:
            self._submit()
        except OSError:  # of the connection: files that cannot be written are told by `ResultStore`
            raise self._gone("no scheduler") from None

    def _submit(self) -> None:
        for topic in self.tasks:
            self.client.subscribe_topic(topic, self._told)
        futures = {
            topic: self.client.submit(on_worker, task, topic, key=topic, pure=False)
            for topic, task in self.tasks.items()
        }
        try:
            for future in futures.values():
                future.add_done_callback(self.arrived.put)
            while futures:
                self._take(futures)
        finally:
            if futures and self.client.status == "running":  # interrupted: nobody waits for what is left
                with suppress(OSError, TimeoutError):
                    self.client.cancel(list(futures.values()), force=True)

    def _told(self, event: tuple[float, Any]) -> None:
        self.arrived.put(event[1]["row"])

    def _take(self, futures: dict[str, Any]) -> None:
        try:
            item = self.arrived.get(timeout=_LOOK_S)
        except queue.Empty:
            self._look()
            return
        if isinstance(item, dict):
            self._row(item)
        else:
            self._ended(item.key, item)
            futures.pop(item.key, None)

    def _row(self, row: dict[str, Any]) -> None:
        if not self.kept.add(row):
            return
        self.new += 1
        done, total = len(self.kept.rows), len(self.kept.sweep.points)
        self.report.steps_done = done
        self.kept.refresh()
        now = time.monotonic()
        if done == total or now - self._shown > _SHOW_S:
            self._shown = now
            self.report.step(done, total, self._remark(total - done))

    def _remark(self, left: int) -> str:
        seconds = left * (time.monotonic() - self.started) / self.new
        failed = sum(row["outcome"] != "converged" for row in self.kept.rows.values())
        return f"about {duration(seconds)} left" + (f", {failed} without numbers" if failed else "")

    def _ended(self, topic: str, future: Any) -> None:
        """Fetch what the events did not bring, and say why points are missing."""
        if self.client.status != "running":  # a lost connection cancels every future
            raise self._gone("no scheduler")
        key, _, members = self.tasks[topic]
        missing = [number for number, _ in members if number not in self.kept.rows]
        if missing:
            for _, event in self.client.get_events(topic):
                self._row(event["row"])
            missing = [number for number in missing if number not in self.kept.rows]
        if missing:
            reason = _why(future)
            for number in missing:
                self.kept.lose(number, reason)
            self.report.say(f"{len(missing)} points lost: {reason}")
        self.client.unsubscribe_topic(topic)

    def _look(self) -> None:
        """Nothing came for a while: is anybody there?"""
        now = time.monotonic()
        if self.client.status != "running":
            raise self._gone("no scheduler")
        if self.client.scheduler_info(n_workers=-1)["workers"]:
            self._seen = now
        elif now - self._seen > WAIT_S:
            raise self._gone("no worker")

    def _gone(self, what: str) -> MissingError:
        return MissingError(f"sweep: {what} is left; {self.kept.said()}; the same command goes on")


def _why(future: Any) -> str:
    """Reason, in one line, that a body ended without all of its points."""
    from distributed import KilledWorker

    if future.status == "cancelled":
        return "its task was cancelled; the same command tries it again"
    error = future.exception() if future.status == "error" else None
    if isinstance(error, KilledWorker):
        return (
            "every worker that was given this body died, the last try included; for lack of memory? "
            "try a coarser mesh or fewer --workers; the same command tries it again"
        )
    if error is None:
        return "no row arrived; the same command tries it again"
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def duration(seconds: float) -> str:
    """Time in words, short."""
    if seconds < 90.0:
        return f"{math.ceil(seconds)} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
