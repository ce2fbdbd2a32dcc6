"""Progress of a long job: a bar on a terminal, plain lines in logs and pipes, nothing when called from Python."""

from __future__ import annotations

import os
import shutil
import sys
import time
from types import TracebackType
from typing import TextIO

from finger3d._ranges import printable

_LEAST_COLUMNS = 20
"""Width below which cyclopts and rich break lines without end."""


class Progress:
    """Receiver of the progress of a job. This base class, the default, prints nothing.

    Attributes
    ----------
    steps_done, steps_total : number of finished steps and number of all steps
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
        """Announce a stage of the job, for instance ``meshing``."""

    def step(self, done: int, total: int, text: str = "") -> None:
        """Report that `done` of `total` steps are finished, with a remark on the last one."""
        self.steps_done, self.steps_total = done, total

    def remark(self, text: str) -> None:
        """Remark on what is tried within a step; shown at most once a second."""

    def say(self, text: str) -> None:
        """Print a permanent line, for instance that a mesh was read from the cache."""


QUIET = Progress()
"""Receiver that prints nothing, for what only announces stages."""


class PlainProgress(Progress):
    """Progress as one line for each event, with the seconds since the start; for logs and pipes."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self.stream = stream if stream is not None else sys.stdout
        self.start = self.shown = time.perf_counter()

    def _line(self, text: str) -> None:
        # in one piece: an interruption may fall between the text and the end that print() adds
        self.shown = time.perf_counter()
        line = f"[{self.shown - self.start:7.1f} s] {printable(text)}\n"
        print(line, end="", file=self.stream, flush=True)

    def stage(self, text: str) -> None:
        """Print the stage."""
        self._line(text)

    def step(self, done: int, total: int, text: str = "") -> None:
        """Print the step and its remark."""
        super().step(done, total, text)
        self._line(f"{done} of {total}" + (f": {text}" if text else ""))

    def remark(self, text: str) -> None:
        """Print the remark, unless another line was printed in the last second."""
        if time.perf_counter() - self.shown > 1.0:
            self._line(text)

    def say(self, text: str) -> None:
        """Print the remark."""
        self._line(text)


class BarProgress(Progress):
    """Progress bar with the stage, the number of steps, the elapsed time and the last remark."""

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
        # A task without a total pulses, because the duration of meshing is unknown.
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
        """Show the stage; the bar pulses until the first step."""
        self.progress.update(self.task, description=printable(text), total=None, count="", remark="")

    def step(self, done: int, total: int, text: str = "") -> None:
        """Move the bar."""
        super().step(done, total, text)
        self.progress.update(self.task, completed=done, total=total, count=f"{done}/{total}", remark=printable(text))

    def remark(self, text: str) -> None:
        """Show the remark beside the bar, which is drawn some times a second only."""
        self.progress.update(self.task, remark=printable(text))

    def say(self, text: str) -> None:
        """Print a line above the bar."""
        self.console.print(printable(text), markup=False)


def reporter(stream: TextIO | None = None) -> Progress:
    """Return a progress bar for an interactive terminal, and plain lines for a pipe, a dumb terminal or CI.

    Parameters
    ----------
    stream : output stream; None for standard output
    """
    target = stream or sys.stdout
    unicode = (target.encoding or "utf-8").lower().startswith("utf")  # bar and spinner are not ASCII
    interactive = target.isatty() and unicode and os.environ.get("TERM") != "dumb" and not os.environ.get("CI")
    return BarProgress(stream) if interactive else PlainProgress(stream)


def least_width() -> None:
    """Let text be at least 20 columns wide on a terminal that says it is narrower."""
    said = os.environ.get("COLUMNS", "")
    width = int(said) if said.isdecimal() else shutil.get_terminal_size().columns
    if width < _LEAST_COLUMNS:
        os.environ["COLUMNS"] = str(_LEAST_COLUMNS)
