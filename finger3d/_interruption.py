"""Signals that interrupt a command: each raises one KeyboardInterrupt in the main thread, which cannot be lost."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_AGAIN_S = 0.02
"""Time after which an interruption that fell into a callback is repeated."""


def _termination_signals() -> list[signal.Signals]:
    """Return SIGTERM and SIGHUP, as far as the system has them: Windows has no SIGHUP."""
    return [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


@contextmanager
def termination_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt on SIGTERM and SIGHUP within the block, unless they are ignored (``nohup``).

    Python prints and drops exceptions of callbacks of weak references and of ``__del__``. A KeyboardInterrupt among
    them is raised again shortly afterwards.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    names = [s for s in _termination_signals() if signal.getsignal(s) is signal.SIG_DFL]
    before = sys.unraisablehook

    def unraisable(dropped: sys.UnraisableHookArgs) -> None:
        if issubclass(dropped.exc_type, KeyboardInterrupt):
            threading.Timer(_AGAIN_S, _thread.interrupt_main).start()
        else:
            before(dropped)

    sys.unraisablehook = unraisable
    for name in names:
        signal.signal(name, signal.default_int_handler)
    try:
        yield
    finally:
        for name in names:
            signal.signal(name, signal.SIG_DFL)
        sys.unraisablehook = before


def interruption_ends_process() -> None:
    """End the process at once, with exit code 130, at an interruption that comes after the work."""

    def end(number: int, frame: FrameType | None) -> None:
        os._exit(130)

    for name in (signal.SIGINT, *_termination_signals()):
        if signal.getsignal(name) is not signal.SIG_IGN:
            signal.signal(name, end)
