"""Sweeps on an existing Dask cluster."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib.metadata import version
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from finger3d import _extras
from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.store import DIED, BodyPoints, SweepProgress
from finger3d.errors import Finger3dError, MissingError
from finger3d.results.journal import Row

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_S = 10.0
"""Time limit to reach a scheduler, and for the first worker to be there."""

WAIT_S = 60.0
"""Time limit without any worker on a cluster."""

_POLL_S = 0.5
"""Interval at which the connection to the cluster is checked."""


@contextmanager
def remote(address: str) -> Iterator[Client]:
    """Client of the cluster whose scheduler is at `address`, which has workers with this version of finger3d."""
    _extras.require("sweep --scheduler", "distributed", instead="leave out --scheduler for processes on this machine")
    from distributed import Client

    if ":" not in address.removeprefix("tcp://").removeprefix("tls://"):
        raise Finger3dError(f"--scheduler {address}: must be HOST:PORT, for instance tcp://127.0.0.1:8786")
    for name in ("distributed", "distributed.client"):  # the second has a level of its own in Dask's configuration
        logging.getLogger(name).setLevel(logging.CRITICAL)
    advice = "start one with `dask scheduler`, or look at the address"
    silent = MissingError(f"--scheduler {address}: no Dask scheduler answered within {CONNECT_S:g} s; {advice}")
    try:
        asyncio.run(asyncio.wait_for(_greet(address), CONNECT_S))
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except ValueError as error:
        raise Finger3dError(f"--scheduler {address}: no address: {error}") from None
    except (OSError, TimeoutError, ImportError):
        raise silent from None
    with client:
        try:
            _ready(client, address)
        except OSError:
            raise silent from None
        yield client


async def _greet(address: str) -> None:
    """Reach a scheduler and leave: a Client waits without end for one that accepts and says nothing."""
    from distributed.comm.core import connect

    comm = await connect(address, timeout=CONNECT_S)
    comm.abort()


def _ready(client: Client, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError:
        raise MissingError(
            f"--scheduler {address}: has no worker; start some with `dask worker {address} --nthreads 1`"
        ) from None
    here = version("finger3d")
    # the function is of the standard library: a worker without finger3d could not load one of this package
    for place, there in client.run(version, "finger3d", on_error="return").items():
        if there != here:
            has = f"has finger3d {there}" if isinstance(there, str) else "has no finger3d"
            raise MissingError(f"--scheduler {address}: the worker {place} {has}; install finger3d {here} there")


class Cluster:
    """Presses on a Dask cluster: as many bodies at a time as there are workers, one batch of points after another."""

    def __init__(self, client: Client, progress: SweepProgress) -> None:
        self.client, self.progress = client, progress
        self._running: dict[Future[list[Row]], tuple[BodyPoints, str | None]] = {}
        self._finished: SimpleQueue[Future[list[Row]]] = SimpleQueue()
        self._seen = time.monotonic()

    def press(self, bodies: Sequence[BodyPoints]) -> None:
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

    def _submit(self, body: BodyPoints, address: str | None = None) -> None:
        """Send the next batch of a body, to the worker that has condensed it if that is still there."""
        where = {"workers": address and [address], "allow_other_workers": address is not None}
        future = self.client.submit(worker.batch, body.spec, body.next, body.size, pure=False, **where)
        self._running[future] = body, address
        future.add_done_callback(self._finished.put)

    def _receive(self) -> None:
        """Store the rows of one batch, and send the next one of its body."""
        if self.client.status != "running":  # which cancels every future
            raise self._lost("scheduler")
        try:
            future = self._finished.get(timeout=_POLL_S)
        except Empty:
            if self._workers():
                self._send_again()
            return
        if future not in self._running:  # cancelled, and sent again
            return
        body, _ = self._running.pop(future)
        if future.status != "finished":
            if self.client.status != "running":  # a lost connection cancels every future
                raise self._lost("scheduler")
            self.progress.give_up(body, _reason(future))
            return
        address = next(iter(self.client.who_has([future]).get(future.key, ())), None)
        rows: list[Row] = future.result()
        for row in rows:
            self.progress.add(row)
        body.advance(rows)
        if body.left:
            self._submit(body, address)

    def _send_again(self) -> None:
        """Send the batches of workers that have left without an address: Dask gives them to no other worker."""
        there = self.client.nthreads()
        stranded = {f: body for f, (body, address) in self._running.items() if address and address not in there}
        for future, body in stranded.items():
            del self._running[future]
            self.client.cancel([future], force=True)
            self._submit(body)

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
        return DIED
    if error is None:
        return "its task was cancelled; the same command tries it again"
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
