"""Ctrl-C, a full disk and a second run: nothing half-written is taken for a result, and nothing ends in a traceback."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

import finger3d.analyses.press
from finger3d.cli import main
from finger3d.io import claimed

SECTION = ["--set", "model.domain=plane-strain", "--set", "mesh.size_mm=2.0", "--set", "mesh.base_size_mm=8.0"]


def press(root: Path, out: Path, *options: str) -> list[str]:
    scene = root / "geometries" / "fig9.toml"
    return [sys.executable, "-m", "finger3d", "press", str(scene), "--out", str(out), *options]


def judge(done: subprocess.CompletedProcess, out: Path) -> None:
    """What must hold whenever the interruption came."""
    # Python ends by the signal itself if it came while exec() ran; a shell shows 130 for either.
    assert done.returncode in (0, 130, -signal.SIGINT), done.stderr
    assert "Traceback" not in done.stderr
    if "results " not in done.stdout:
        assert done.stderr.strip().splitlines()[-1].startswith("finger3d: interrupted")
    left = [p.name for p in out.iterdir()] if out.is_dir() else []
    assert not [name for name in left if name.startswith(".") and not name.endswith(".lock")]
    if "summary.json" in left:
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
        # After the last file is written there is nothing left to interrupt but the closing table.
        whole = {"fields.vtu", "history.csv", "contact.csv", "scene.toml"} <= set(left)
        assert summary["outcome"].startswith("incomplete") or (summary["outcome"] == "converged" and whole)


def interrupted(command: list[str], seconds: float, cwd: Path) -> subprocess.CompletedProcess:
    running = subprocess.Popen(
        command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    time.sleep(seconds)
    os.killpg(running.pid, signal.SIGINT)
    stdout, stderr = running.communicate(timeout=60)
    return subprocess.CompletedProcess(command, running.returncode, stdout, stderr)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("domain", "shares"),
    [("plane-strain", (0.15, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)), ("solid", (0.2, 0.5, 0.8, 0.95))],
)
def test_ctrl_c_at_any_moment(root: Path, tmp_path: Path, domain: str, shares: tuple[float, ...]) -> None:
    out = tmp_path / "ein Ordner mit Umläuten"
    start = time.perf_counter()
    subprocess.run(press(root, out, "--set", f"model.domain={domain}"), check=True, capture_output=True, cwd=root)
    whole = time.perf_counter() - start
    # Python itself, before a line of ours runs, answers with a traceback: hence not from the very start.
    for share in shares:
        shutil.rmtree(out)
        out.mkdir()
        done = interrupted(press(root, out, "--set", f"model.domain={domain}"), share * whole, root)
        judge(done, out)


def test_ctrl_c_while_the_steps_are_written(root: Path, tmp_path: Path) -> None:
    out = tmp_path / "ein Ordner mit Umläuten"
    running = subprocess.Popen(
        press(root, out, *SECTION, "--set", "press.steps=3000", "--no-figures"),
        cwd=root, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    assert running.stdout is not None
    while " of 3000: depth" not in (seen := running.stdout.readline()):
        assert seen
    running.send_signal(signal.SIGINT)
    printed, _ = running.communicate(timeout=60)
    judge(subprocess.CompletedProcess([], running.returncode, "", printed), out)
    assert "of 3000 increments" in printed
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["steps"]


def with_environment(text: str) -> list[int]:
    """Running processes whose environment contains a text."""
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):  # of a process that has ended meanwhile
            if text.encode() in path.read_bytes():
                found.append(int(path.parent.name))
    return found


def until(true: Callable[[], bool], seconds: float) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc, and relies on prctl")
@pytest.mark.parametrize(("sent", "code"), [(signal.SIGTERM, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_a_press_killed_while_it_meshes_leaves_no_child_and_no_folder(
    root: Path, tmp_path: Path, sent: signal.Signals, code: int
) -> None:
    temporary, cache = tmp_path / "tmp", tmp_path / "cache"
    temporary.mkdir()
    env = {**os.environ, "TMPDIR": str(temporary), "FINGER3D_CACHE": str(cache), "OMP_NUM_THREADS": "1"}
    command = press(root, tmp_path / "out", "--set", "mesh.size_mm=1.5")  # half a minute of meshing
    running = subprocess.Popen(command, cwd=root, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def meshing() -> bool:
        names = [Path(f"/proc/{pid}/cmdline") for pid in with_environment(str(cache))]
        return any(path.exists() and b"pytetwild" in path.read_bytes() for path in names)

    until(meshing, 60.0)
    time.sleep(1.0)  # it loads pytetwild
    running.send_signal(sent)
    _, printed = running.communicate(timeout=60)
    assert running.returncode == code
    assert "Traceback" not in printed
    until(lambda: not with_environment(str(cache)), 5.0)
    assert not list(temporary.iterdir())
    assert not list(cache.rglob("*.npz"))
    if sent == signal.SIGTERM:
        assert printed.splitlines()[-1].startswith("finger3d: interrupted")


def test_an_import_that_ctrl_c_broke_off_is_an_interruption(root: Path, tmp_path, monkeypatch, capsys) -> None:
    def broken(*args: object, **kwargs: object) -> None:
        raise ImportError("initialization failed") from KeyboardInterrupt()

    monkeypatch.setattr(finger3d.analyses.press, "press", broken)
    assert main(press(root, tmp_path / "out")[3:]) == 130
    assert capsys.readouterr().err.startswith("finger3d: interrupted")


def test_an_import_that_fails_otherwise_is_not_hidden(root: Path, tmp_path, monkeypatch) -> None:
    def broken(*args: object, **kwargs: object) -> None:
        raise ImportError("no module")

    monkeypatch.setattr(finger3d.analyses.press, "press", broken)
    with pytest.raises(ImportError, match="no module"):
        main(press(root, tmp_path / "out")[3:])


def test_two_runs_into_one_folder(root: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    with claimed(out):
        assert main(press(root, out, *SECTION)[3:]) == 2
    assert capsys.readouterr().err.strip().splitlines()[-1].startswith(f"finger3d: {out}: ")
    assert main(press(root, out, *SECTION, "--no-figures")[3:]) == 0


def test_results_of_another_command_are_not_replaced(root: Path, tmp_path: Path, capsys) -> None:
    (tmp_path / "calibration.json").write_text("{}")
    assert main(press(root, tmp_path, *SECTION)[3:]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert said.startswith(f"finger3d: --out {tmp_path}: ")
    assert "calibrate" in said
    assert [p.name for p in tmp_path.iterdir()] == ["calibration.json"]


@pytest.mark.parametrize(
    "words", ["sweep --vary friction.mu=0.1,0.2", "optimise --free gauge.g36.angle_deg=0:90"], ids=["sweep", "optimise"]
)
def test_a_sweep_and_a_design_take_no_other_results_folder(root: Path, tmp_path: Path, capsys, words: str) -> None:
    (tmp_path / "summary.json").write_text("{}")
    command, *options = words.split()
    scene = root / "geometries" / "fig9.toml"
    assert main([command, str(scene), "--out", str(tmp_path), *options, *SECTION]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert said.startswith(f"finger3d: --out {tmp_path}: ")
    assert "press" in said


def test_a_disk_that_fills(root: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    done = []

    def full(source: str | Path, target: str | Path) -> None:
        if Path(target).name == "history.csv" and len(done) > 1:
            raise OSError(errno.ENOSPC, "No space left on device")
        done.append(target)
        replace(source, target)

    replace = os.replace
    monkeypatch.setattr(os, "replace", full)
    assert main(press(root, tmp_path, *SECTION, "--no-figures")[3:]) == 3
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert f"{tmp_path / 'history.csv'}: {os.strerror(errno.ENOSPC)}" in error
    assert not [p.name for p in tmp_path.iterdir() if p.name.startswith(".") and p.suffix != ".lock"]
    assert json.loads((tmp_path / "summary.json").read_text())["outcome"].startswith("incomplete")
