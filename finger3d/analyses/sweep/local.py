"""Worker processes of a sweep on this machine: one body at a time in each, one batch of points after another."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from queue import Empty, SimpleQueue
from typing import IO

from finger3d._machine import cores
from finger3d._process import child_environment
from finger3d.analyses.sweep.points import BodySpec, Point
from finger3d.analyses.sweep.progress import BodyPoints, SweepProgress
from finger3d.errors import MissingError
from finger3d.results.journal import Row

ATTEMPTS = 4
"""Workers that a body may end before its points are given up."""

_POLL_S = 0.5
"""Longest time without a look at the state of the workers."""


class WorkerProcess:
    """A child process that presses batches of points, and that Ctrl-C in a terminal does not reach."""

    def __init__(self) -> None:
        self._log = tempfile.TemporaryFile()  # its standard error: the last line tells why it died
        command = [sys.executable, "-P", "-m", "finger3d.analyses.sweep._child", str(os.getpid())]
        try:
            self._process = subprocess.Popen(
                command,
                env=child_environment(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                start_new_session=True,  # POSIX
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # Windows
            )
        except OSError as error:
            raise MissingError(f"sweep: no worker could be started on this machine: {error}") from None

    def batch(self, spec: BodySpec, points: Sequence[Point], size: int) -> list[Row]:
        """Press the first `size` points of a body; see `finger3d.analyses.sweep.worker.batch`.

        Raises
        ------
        EOFError
            If the process died.
        RuntimeError
            If it could not press them; the text says why.
        """
        assert self._process.stdin
        assert self._process.stdout
        try:
            send(self._process.stdin, (spec, list(points), size))
            rows, reason = pickle.load(self._process.stdout)
        except (OSError, pickle.UnpicklingError) as error:
            raise EOFError from error
        if reason:
            raise RuntimeError(reason)
        found: list[Row] = rows
        return found

    def death(self) -> str:
        """Return in a few words how the process ended."""
        code = self._process.wait()
        self._log.seek(0)
        said = self._log.read().decode(errors="replace").strip().splitlines()
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        return f"{how}: {said[-1]}" if said else how

    def end(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream
            try:
                stream.close()
            except BrokenPipeError:  # something was still to be sent
                continue


def send(stream: IO[bytes], value: object) -> None:
    """Write a pickled value."""
    pickle.dump(value, stream)
    stream.flush()


class _Runner(threading.Thread):
    """A thread with a worker process of its own, which takes bodies until none is left.

    It puts (body, rows) of each batch on `finished`, or (body, reason) if the body is given up, and at its end None
    or the error that ended it. The main thread stores them.
    """

    def __init__(self, waiting: SimpleQueue[BodyPoints], finished: SimpleQueue[object], stop: threading.Event) -> None:
        super().__init__(daemon=True)
        self._waiting, self._finished, self._stop_asked = waiting, finished, stop
        self.process: WorkerProcess | None = None

    def run(self) -> None:
        """Press bodies until none is left, or until it is asked to stop."""
        try:
            while not self._stop_asked.is_set():
                self._press(self._waiting.get_nowait())
            self._finished.put(None)
        except Empty:
            self._finished.put(None)
        except MissingError as error:
            self._finished.put(error)
        finally:
            if self.process is not None:
                self.process.end()

    def _press(self, body: BodyPoints) -> None:
        died = 0
        while body.left and not self._stop_asked.is_set():
            if self.process is None:
                self.process = WorkerProcess()
            try:
                rows = self.process.batch(body.spec, body.left, body.size)
            except EOFError:
                if self._stop_asked.is_set():
                    return
                how, died = self.process.death(), died + 1
                self.process.end()
                self.process = None
                if died == ATTEMPTS:
                    self._finished.put((body, _died(how)))
                    return
            except RuntimeError as error:
                self._finished.put((body, str(error)))
                return
            else:
                body.advance(rows)
                self._finished.put((body, rows))


def _died(how: str) -> str:
    return (
        f"every worker that was given this body died ({how}), perhaps for lack of memory; "
        "try a coarser mesh or fewer --workers; the same command tries it again"
    )


def press(bodies: Sequence[BodyPoints], progress: SweepProgress, workers: int) -> None:
    """Press all points of some bodies in `workers` processes with one thread each.

    Raises
    ------
    MissingError
        If no process could be started, or a row cannot be stored.
    """
    waiting: SimpleQueue[BodyPoints] = SimpleQueue()
    for body in bodies:
        waiting.put(body)
    finished: SimpleQueue[object] = SimpleQueue()
    stop = threading.Event()
    runners = [_Runner(waiting, finished, stop) for _ in range(min(workers, len(bodies)))]
    try:
        for runner in runners:
            runner.start()
        running = len(runners)
        while running:
            try:
                found = finished.get(timeout=_POLL_S)
            except Empty:  # Windows delivers Ctrl-C only between waits
                continue
            if isinstance(found, MissingError):
                raise found
            if found is None:
                running -= 1
            elif isinstance(found, tuple):
                _store(progress, *found)
    finally:
        stop.set()
        for runner in runners:
            if runner.process is not None:
                runner.process.end()


def _store(progress: SweepProgress, body: BodyPoints, found: list[Row] | str) -> None:
    if isinstance(found, str):
        progress.give_up(body, found)
    else:
        for row in found:
            progress.add(row)


def default_workers(bodies: int) -> int:
    """Return the number of cores, or of bodies if these are fewer."""
    return max(1, min(cores(), bodies))
