"""Progress of a long job: a bar on a terminal, plain lines elsewhere, nothing in a script."""

from __future__ import annotations

import os
import sys
import time
from types import TracebackType
from typing import TextIO

from finger3d._ranges import printable


class Progress:
    """Receiver of a job's progress; this one, the default, prints nothing.

    Attributes
    ----------
    steps_done, steps_total : number of finished steps and of all, for the message after an interruption
    """

    steps_done: int = 0
    steps_total: int = 0

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was."""

    def stage(self, text: str) -> None:
        """Begin a part of the job, for instance ``meshing``."""

    def step(self, done: int, total: int, text: str = "") -> None:
        """Report that `done` of `total` steps are finished, with a short remark on the last one."""
        self.steps_done, self.steps_total = done, total

    def say(self, text: str) -> None:
        """Print a line that remains, for instance that a mesh came from the cache."""


class PlainProgress(Progress):
    """One line per event with the seconds since the start, for logs and pipes."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self.stream = stream if stream is not None else sys.stdout
        self.start = time.perf_counter()

    def _line(self, text: str) -> None:
        print(f"[{time.perf_counter() - self.start:7.1f} s] {printable(text)}", file=self.stream, flush=True)

    def stage(self, text: str) -> None:
        """Print the stage."""
        self._line(text)

    def step(self, done: int, total: int, text: str = "") -> None:
        """Print the step and its remark."""
        super().step(done, total, text)
        self._line(f"step {done} of {total}" + (f": {text}" if text else ""))

    def say(self, text: str) -> None:
        """Print the remark."""
        self._line(text)


class BarProgress(Progress):
    """A rich progress bar: the stage, a bar over the steps, the elapsed time and the last remark."""

    def __init__(self, stream: TextIO | None = None) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as RichProgress

        self.console = Console(highlight=False, file=stream)
        self.progress = RichProgress(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=30),
            TextColumn("{task.fields[count]}", markup=False),
            TimeElapsedColumn(),
            TextColumn("{task.fields[remark]}", style="dim", markup=False),
            console=self.console,
            transient=True,
        )
        # A task without a total pulses: the duration of meshing is not known.
        self.task = self.progress.add_task("starting", total=None, count="", remark="")

    def __enter__(self) -> BarProgress:
        self.progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the bar."""
        self.progress.stop()

    def stage(self, text: str) -> None:
        """Name the stage and let the bar pulse."""
        self.progress.update(self.task, description=printable(text), total=None, count="", remark="")

    def step(self, done: int, total: int, text: str = "") -> None:
        """Move the bar."""
        super().step(done, total, text)
        self.progress.update(self.task, completed=done, total=total, count=f"{done}/{total}", remark=printable(text))

    def say(self, text: str) -> None:
        """Print a line above the bar."""
        self.console.print(printable(text), markup=False)


def reporter(stream: TextIO | None = None) -> Progress:
    """Return a bar for an interactive terminal, plain lines for a pipe, a dumb terminal or CI.

    Parameters
    ----------
    stream : where to print; None: standard output
    """
    target = stream or sys.stdout
    unicode = (target.encoding or "utf-8").lower().startswith("utf")  # bar and spinner are not ASCII
    interactive = target.isatty() and unicode and os.environ.get("TERM") != "dumb" and not os.environ.get("CI")
    return BarProgress(stream) if interactive else PlainProgress(stream)
