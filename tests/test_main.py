"""The entry point, errors and interruption."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import weakref
from contextlib import suppress
from pathlib import Path

import pytest

from finger3d import cli
from finger3d._interruption import termination_interrupts
from finger3d.cli import main
from finger3d.errors import OUT_OF_MEMORY, out_of_memory
from tests.scenes import HALF_CYLINDER


def test_python_m_runs_the_command_line(tmp_path) -> None:
    command = [sys.executable, "-m", "finger3d", "plan", "nothing.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "finger3d: nothing.toml: there is no such file\n"
    assert done.stdout == ""


def run(words: list[str], before: str = "", **settings: object) -> subprocess.CompletedProcess[str]:
    """Run finger3d in a shell, after another command in it."""
    line = f'{before} exec "$@"'
    command = ["bash", "-c", line, "bash", sys.executable, "-m", "finger3d", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, **settings)


def test_a_working_folder_that_was_removed_is_told(tmp_path, root) -> None:
    scene, gone = str(root / "geometries" / "edge.toml"), tmp_path / "gone"
    gone.mkdir()
    env = {**os.environ, "PYTHONPATH": str(root)}
    for out in ("o", str(tmp_path / "o")):
        done = run(["press", scene, "--out", out], f"cd {gone}; rmdir {gone};", cwd=tmp_path, env=env)
        assert done.returncode == 2
        assert done.stderr == "finger3d: the working folder has been removed; change into one that exists\n"
        gone.mkdir()


def test_an_empty_value_is_refused(tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["press", "scene.toml", "--out="]) == 2
    assert capsys.readouterr().err == "finger3d: the value after --out is empty; give one\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform != "linux", reason="ulimit -v")
@pytest.mark.parametrize("kilobytes", [200_000, 420_000, 1_500_000])
def test_a_limit_of_the_address_space_ends_with_one_line_or_a_result(kilobytes, root, tmp_path) -> None:
    """OpenBLAS repeats an allocation without end, so that a press would never end."""
    scene = tmp_path / "scene.toml"
    scene.write_text(HALF_CYLINDER, encoding="utf-8")
    words = ["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures", "--no-error"]
    env = {**os.environ, "PYTHONPATH": str(root), "OMP_NUM_THREADS": "1", "FINGER3D_CACHE": str(tmp_path)}
    env |= {"OPENBLAS_NUM_THREADS": "1"}
    done = run(words, f"ulimit -v {kilobytes};", env=env)
    assert done.returncode == (0 if kilobytes == 1_500_000 else 3), done.stderr
    if done.returncode:
        assert done.stderr.splitlines()[-1].startswith("finger3d: out of memory")
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("error", "memory"),
    [
        (MemoryError("Unable to allocate 6 GiB"), True), (OSError(12, "Cannot allocate memory"), True),
        (RuntimeError("can't start new thread"), True), (OSError(2, "No such file"), False),
    ],
)  # fmt: skip
def test_what_says_that_memory_ran_out(error: BaseException, memory: bool, monkeypatch, capsys) -> None:
    assert out_of_memory(error) is memory

    def fails(*args: object, **kwargs: object) -> int:
        raise error

    monkeypatch.setattr(cli, "app", fails)
    if memory:
        assert cli.main(["info"]) == 3
        assert capsys.readouterr().err == f"finger3d: {OUT_OF_MEMORY}\n"
    else:
        with pytest.raises(type(error)):
            cli.main(["info"])


@pytest.mark.parametrize(
    "command",
    [
        "press --no-figures --out OUT", "sensitivity --of gauge_g --out OUT", "cost",
        "sweep --workers 1 --out OUT --vary friction.mu=0.1,0.2",
        "identify --measured CSV --free material.E_MPa=0.1:1 --out OUT",
        "optimise --budget 1 --free gauge.g.x_mm=1:2 --out OUT", "calibrate --gauge g --out OUT",
    ],
)  # fmt: skip
def test_an_increment_that_does_not_converge_is_exit_code_3(command: str, tmp_path: Path, capsys) -> None:
    """No force of 1000 N is reached in a finger 5 mm high and 2 mm wide with E = 1 MPa."""
    scene, csv = tmp_path / "scene.toml", tmp_path / "bench.csv"
    scene.write_text(HALF_CYLINDER.replace("depth_mm = 0.5", "force_N = 1e3"))
    csv.write_text("step,gauge_g\n1,0.01\n2,0.02\n4,0.05\n")
    name, *options = command.replace("OUT", str(tmp_path / "out")).replace("CSV", str(csv)).split()
    assert cli.main([name, str(scene), *options]) == 3
    assert "the prescribed force is not reached" in capsys.readouterr().err


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


def test_an_error_in_place_of_an_interruption_ends_the_block_as_one() -> None:
    def work() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise TypeError("as numpy does") from None

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


@pytest.mark.parametrize("name", ["SIGINT", "SIGHUP"])
def test_an_interruption_after_the_work_ends_the_process_with_130(name: str) -> None:
    code = (
        "import signal, sys, time; import finger3d.__main__ as m; sys.argv = ['finger3d', 'new', '--schema']; "
        "signal.signal(signal.SIGHUP, signal.SIG_DFL); "  # under nohup, the child would inherit that it is ignored
        f"m.main(); signal.raise_signal(signal.{name}); time.sleep(20)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 130
    assert done.stderr == ""
