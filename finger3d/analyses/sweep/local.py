"""Sweeps on this machine: every worker is a process with one thread that presses one body after another."""

from __future__ import annotations

import os
import signal
from collections import Counter, deque
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from finger3d._machine import end_with, reserve_for_linear_algebra
from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.store import DIED, BodyPoints, SweepProgress
from finger3d.errors import MissingError
from finger3d.results.journal import Row

if TYPE_CHECKING:
    from loky import ProcessPoolExecutor

ATTEMPTS = 4
"""Number of workers that may die while pressing a body before its points are given up."""

_POLL_S = 0.5
"""Longest time without an answer to Ctrl-C, which Windows delivers between waits only."""


def _pool() -> ProcessPoolExecutor:
    from loky import ProcessPoolExecutor

    return ProcessPoolExecutor(1, initializer=_begin, initargs=(os.getpid(),))


@dataclass
class _Worker:
    """A pool of one process, which keeps the body of its last batch; a new one takes the place of one that died."""

    pool: ProcessPoolExecutor = field(default_factory=lambda: _pool())

    def submit(self, body: BodyPoints) -> Future[list[Row]]:
        """Press the next batch of a body."""
        future: Future[list[Row]] = self.pool.submit(worker.batch, body.spec, body.next, body.size)
        return future

    def replace(self) -> None:
        """Start again with a new process."""
        self.end()
        self.pool = _pool()

    def end(self) -> None:
        """Kill the process."""
        self.pool.shutdown(wait=True, kill_workers=True)


def _begin(parent: int) -> None:
    """Initialise a worker: it ends with its parent, and leaves Ctrl-C to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with(parent)
    reserve_for_linear_algebra()


def press(bodies: Sequence[BodyPoints], progress: SweepProgress, workers: int) -> None:
    """Press all points of some bodies in `workers` processes with one thread each.

    Raises
    ------
    MissingError
        If no process could be started.
    Finger3dError
        If a row cannot be stored.
    """
    waiting, deaths = deque(bodies), Counter[int]()
    running: dict[Future[list[Row]], tuple[_Worker, BodyPoints]] = {}
    started: list[_Worker] = []
    try:
        while len(started) < min(workers, len(bodies)):
            started.append(one := _Worker())
            _begin_next(one, waiting, running)
        while running:
            finished, _ = wait(running, _POLL_S, FIRST_COMPLETED)
            for future in finished:
                one, body = running.pop(future)
                _take(future, one, body, progress, deaths)
                if body.left:
                    running[one.submit(body)] = one, body
                else:
                    _begin_next(one, waiting, running)
    except OSError as error:
        raise MissingError(
            f"sweep: no worker could be started on this machine: {error}; --workers 1 presses without any"
        ) from None
    finally:
        for one in started:
            one.end()


def _begin_next(
    one: _Worker, waiting: deque[BodyPoints], running: dict[Future[list[Row]], tuple[_Worker, BodyPoints]]
) -> None:
    if waiting:
        body = waiting.popleft()
        running[one.submit(body)] = one, body


def _take(
    future: Future[list[Row]], one: _Worker, body: BodyPoints, progress: SweepProgress, deaths: Counter[int]
) -> None:
    """Store the rows of a batch, or give up a body that cannot be pressed: it then has no points left."""
    try:
        rows = future.result()
    except BrokenProcessPool as error:
        deaths[id(body)] += 1
        one.replace()
        if deaths[id(body)] == ATTEMPTS:
            progress.give_up(body, f"{DIED} ({' '.join(str(error).split())})")
    except Exception as error:  # noqa: BLE001 - whatever a worker raised is reported with the points that are lost
        progress.give_up(body, f"{type(error).__name__}: {' '.join(str(error).split())}")
    else:
        body.advance(rows)
        for row in rows:
            progress.add(row)
