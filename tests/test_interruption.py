"""Interruptions: SIGTERM ends a command as Ctrl-C does, and no interruption is lost in a callback."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
import weakref
from contextlib import suppress

import pytest

from finger3d._interruption import termination_interrupts


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_termination_is_an_interruption(name: str) -> None:
    number = getattr(signal, name)
    outside = signal.signal(number, signal.SIG_DFL)  # under nohup, SIGHUP would be ignored
    try:
        with pytest.raises(KeyboardInterrupt), termination_interrupts():
            signal.raise_signal(number)
        assert signal.getsignal(number) == signal.SIG_DFL
    finally:
        signal.signal(number, outside)


def test_an_ignored_hangup_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with termination_interrupts():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_commands_run_outside_the_main_thread() -> None:
    def run() -> None:
        with termination_interrupts():
            done.append(True)

    done: list[bool] = []
    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert done


def wait() -> None:
    end = time.monotonic() + 10.0
    while time.monotonic() < end:
        pass


@pytest.mark.parametrize("converted", [False, True], ids=["caught", "turned into an ImportError"])
def test_an_interruption_that_a_package_catches_is_raised_again(converted: bool) -> None:
    def package() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except BaseException as error:
            if converted:
                raise ImportError from error

    def work() -> None:
        with suppress(ImportError):  # as where an extra is looked for
            package()
        wait()

    with pytest.raises(KeyboardInterrupt), termination_interrupts():
        work()


def test_one_interruption_is_one_exception_while_what_is_done_is_kept() -> None:
    """The exception lives while blocks end, however long that takes, and when the command has answered it is over."""
    kept = False
    with termination_interrupts():
        try:
            try:
                signal.raise_signal(signal.SIGINT)
            finally:
                time.sleep(0.1)
                kept = True
        except KeyboardInterrupt:
            pass
    time.sleep(0.1)
    assert kept


class Referent:
    """An object that can be referred to weakly."""


def test_an_interruption_in_a_callback_of_a_weak_reference_is_raised_again(capfd: pytest.CaptureFixture[str]) -> None:
    """As while a module is imported, whose lock is such a reference: Python prints the exception and drops it."""

    def interrupted(reference: object) -> None:
        signal.raise_signal(signal.SIGINT)

    def work() -> None:
        referents.clear()
        wait()

    referents = [Referent()]
    reference = weakref.ref(referents[0], interrupted)
    hook = sys.unraisablehook
    with pytest.raises(KeyboardInterrupt), termination_interrupts():
        work()
    assert reference() is None
    assert sys.unraisablehook is hook
    assert "Exception ignored" not in capfd.readouterr().err


def test_other_exceptions_of_callbacks_are_still_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[type[BaseException]] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda dropped: told.append(dropped.exc_type))

    def broken(reference: object) -> None:
        raise ValueError

    with termination_interrupts():
        referent = Referent()
        reference = weakref.ref(referent, broken)
        del referent
    assert reference() is None
    assert told == [ValueError]


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_an_interruption_after_the_work_ends_the_process_with_130(name: str) -> None:
    code = (
        "import signal, sys, time; import finger3d.__main__ as m; sys.argv = ['finger3d', 'schema']; "
        "signal.signal(signal.SIGHUP, signal.SIG_DFL); "  # under nohup, the child would inherit that it is ignored
        f"m.main(); signal.raise_signal(signal.{name}); time.sleep(20)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 130
    assert done.stderr == ""
