"""Standard streams that never fail, and the descriptors and width of the terminal."""

from __future__ import annotations

import errno
import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any


class SafeStream:
    """A text stream whose ``write`` and ``flush`` never fail.

    After the first failure (closed pipe, full disk) all output is discarded. Characters that the encoding lacks are
    written as backslash escapes.

    Parameters
    ----------
    stream : stream to write to; None discards all output

    Attributes
    ----------
    lost : error that ended the output, or None
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream if stream is not None else open(os.devnull, "w", encoding="utf-8")
        self.lost: Exception | None = None
        with suppress(AttributeError, ValueError):  # of a stream in memory, and of a closed one
            self._stream.reconfigure(errors="backslashreplace")

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write text and return its length."""
        if self.lost is None:
            try:
                self._stream.write(text)
            except (OSError, ValueError) as error:
                self._give_up(error)
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write a sequence of texts."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flush the stream."""
        if self.lost is None:
            try:
                self._stream.flush()
            except (OSError, ValueError) as error:
                self._give_up(error)

    def _give_up(self, error: Exception) -> None:
        self.lost = error
        # At exit the interpreter flushes the remaining buffer, which must not fail.
        with suppress(OSError, ValueError):
            target = os.open(os.devnull, os.O_WRONLY)
            os.dup2(target, self._stream.fileno())
            os.close(target)


@contextmanager
def safe_streams() -> Iterator[None]:
    """Replace ``sys.stdout`` and ``sys.stderr`` by streams that never fail, within the block.

    A job thus writes its results even if the terminal is closed. Any failure other than a closed pipe, for instance a
    full disk, is reported on standard error at the end.
    """
    before = sys.stdout, sys.stderr
    out, err = SafeStream(sys.stdout), SafeStream(sys.stderr)
    sys.stdout, sys.stderr = out, err
    try:
        yield
    finally:
        out.flush()
        if isinstance(out.lost, OSError) and out.lost.errno != errno.EPIPE:
            err.write(
                f"finger3d: standard output: {out.lost.strerror or out.lost}; files of results are not affected\n"
            )
        err.flush()
        sys.stdout, sys.stderr = before


_LEAST_COLUMNS = 20
"""Width below which cyclopts and rich break lines without end."""


def fill_descriptors() -> None:
    """Open the null device for closed standard descriptors, which the next opened file would otherwise take."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            os.set_inheritable(number, True)


def least_width() -> None:
    """Let text be at least 20 columns wide on a terminal that says it is narrower."""
    said = os.environ.get("COLUMNS", "")
    width = int(said) if said.isdecimal() else shutil.get_terminal_size().columns
    if width < _LEAST_COLUMNS:
        os.environ["COLUMNS"] = str(_LEAST_COLUMNS)
