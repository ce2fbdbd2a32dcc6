"""What the commands do when the terminal goes away: a lost standard stream and SIGTERM."""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO


class SafeStream:
    """A text stream whose ``write`` and ``flush`` never fail.

    Once the stream cannot be written (closed pipe, full disk), all later output is discarded. Characters that its
    encoding lacks are written as backslash escapes.

    Parameters
    ----------
    stream : the stream to write to, or None if the process has none

    Attributes
    ----------
    lost : the error that ended the output, or None
    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream if stream is not None else open(os.devnull, "w", encoding="utf-8")
        self.lost: Exception | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write text; return its length."""
        if self.lost is None:
            try:
                try:
                    self._stream.write(text)
                except UnicodeEncodeError:
                    encoding = self._stream.encoding or "ascii"
                    self._stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
            except (OSError, ValueError) as error:
                self._give_up(error)
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write several texts."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flush what was written."""
        if self.lost is None:
            try:
                self._stream.flush()
            except (OSError, ValueError) as error:
                self._give_up(error)

    def _give_up(self, error: Exception) -> None:
        self.lost = error
        # The interpreter flushes what is still buffered when it ends, and fails unless the descriptor accepts it.
        with suppress(OSError, ValueError):
            target = os.open(os.devnull, os.O_WRONLY)
            os.dup2(target, self._stream.fileno())
            os.close(target)


@contextmanager
def safe_streams() -> Iterator[None]:
    """Replace ``sys.stdout`` and ``sys.stderr`` by streams that never fail, within the block.

    A job writes its results whatever becomes of the terminal. A loss other than that of the reader of a pipe, for
    instance a full disk, is reported on standard error at the end.
    """
    _fill_descriptors()
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


def _fill_descriptors() -> None:
    """Open the null device as every standard descriptor that is closed; else the next file opened would become it."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            os.set_inheritable(number, True)


@contextmanager
def termination_interrupts() -> Iterator[None]:
    """Let SIGTERM and SIGHUP raise KeyboardInterrupt within the block, unless they are ignored (``nohup``)."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    names = [s for s in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(s) is signal.SIG_DFL]
    for name in names:
        signal.signal(name, signal.default_int_handler)
    try:
        yield
    finally:
        for name in names:
            signal.signal(name, signal.SIG_DFL)
