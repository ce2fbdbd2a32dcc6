"""Streams that never fail, whatever a terminal, a pipe or a disk does."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator
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
        self._attempt(lambda: self._stream.write(text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write a sequence of texts."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flush the stream."""
        self._attempt(self._stream.flush)

    def _attempt(self, act: Callable[[], object]) -> None:
        try:
            if self.lost is None:
                act()
        except (OSError, ValueError) as error:
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
