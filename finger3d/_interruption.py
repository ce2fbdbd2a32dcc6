"""Signals and standard descriptors of a command: a signal raises one KeyboardInterrupt, which cannot be lost."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_AGAIN_S = 0.02
"""Time after which an interruption that something has caught, or dropped, is repeated."""


class Interruption(KeyboardInterrupt):
    """An interruption, to which weak references can be made."""


def _termination_signals() -> list[signal.Signals]:
    """Return SIGTERM and SIGHUP, as far as the system has them: Windows has no SIGHUP."""
    return [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


@contextmanager
def termination_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt on Ctrl-C, SIGTERM and SIGHUP within the block, unless they are ignored (``nohup``).

    A package may catch the exception and go on, as by a bare ``except`` or in C, and Python prints and drops those of
    callbacks of weak references and of ``__del__``. An exception that has gone while the block still runs is raised
    again shortly afterwards, and takes the place of any other that ends the block.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    signals = [signal.SIGINT, *_termination_signals()]
    before = {s: old for s in signals if (old := signal.getsignal(s)) in (signal.SIG_DFL, signal.default_int_handler)}
    hook, running = sys.unraisablehook, threading.Event()
    raised: list[weakref.ref[Interruption]] = []

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise new()  # a local variable would keep it alive by its traceback

    def new() -> Interruption:
        error = Interruption()
        raised.append(weakref.ref(error, gone))
        return error

    def gone(reference: object) -> None:
        threading.Timer(_AGAIN_S, lambda: _thread.interrupt_main() if running.is_set() else None).start()

    def unraisable(dropped: sys.UnraisableHookArgs) -> None:
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            hook(dropped)

    sys.unraisablehook = unraisable
    running.set()
    for name in before:
        signal.signal(name, interrupt)
    try:
        yield
    except Exception as error:
        if raised:  # loaders of OCP and VTK, and numpy, raise another error in its place
            raise KeyboardInterrupt from error
        raise
    finally:
        running.clear()
        for name, old in before.items():
            signal.signal(name, old)
        sys.unraisablehook = hook


def interruption_ends_process() -> None:
    """End the process at once, with exit code 130, at an interruption that comes after the work."""

    def end(number: int, frame: FrameType | None) -> None:
        os._exit(130)

    for name in (signal.SIGINT, *_termination_signals()):
        if signal.getsignal(name) is not signal.SIG_IGN:
            signal.signal(name, end)


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
