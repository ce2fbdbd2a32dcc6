"""Workers of a sweep: on a cluster, in processes of this machine, and in this process."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest

from finger3d.analyses.sweep import local, worker
from finger3d.analyses.sweep.points import Sweep, checked_points, varied
from finger3d.analyses.sweep.store import BodyPoints, ResultStore, SweepProgress
from finger3d.errors import Finger3dError
from finger3d.progress import Progress
from tests.sweep_cases import points_of, pressed_here, table


def pressed(sweep: Sweep, folder: Path, workers: int) -> ResultStore:
    with ResultStore(sweep, folder).open() as store:
        bodies = [BodyPoints(spec, [p for p in sweep.points if p.body == key]) for key, spec in sweep.bodies.items()]
        local.press(bodies, SweepProgress(store, Progress()), workers)
        return store


def test_workers_return_the_rows_of_a_press_here(paper_scene: Path, tmp_path: Path) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,0.1", "material.nu=0.3,0.4")
    store = pressed(sweep, tmp_path, 2)
    here = {row["point"]: row["normal_force_N"] for row in pressed_here(sweep)}
    assert {number: row["normal_force_N"] for number, row in store.rows.items()} == here


def killed_by(nu: str) -> Any:
    """A batch that kills its process if the body has this Poisson's ratio.

    `worker` is looked up where it runs: `worker.batch` itself would be pickled with the body that this process holds.
    """

    def batch(spec: Any, points: Any, size: int) -> Any:
        if spec.given["material"]["nu"] == float(nu):
            os.kill(os.getpid(), signal.SIGKILL)
        return worker.batch(spec, points, size)

    return batch


@pytest.mark.slow
def test_a_body_that_kills_every_worker_is_given_up_and_others_are_pressed(
    paper_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local.worker, "batch", killed_by("0.3"))
    store = pressed(points_of(paper_scene, "material.nu=0.3,0.4"), tmp_path, 2)
    assert list(store.rows) == [1], store.lost
    assert "SIGKILL" in store.lost[0]["outcome"]


def test_what_a_worker_raises_is_told_with_the_points_that_are_lost(
    paper_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def batch(spec: Any, points: Any, size: int) -> Any:
        raise LookupError("no such body")

    monkeypatch.setattr(local.worker, "batch", batch)
    store = pressed(points_of(paper_scene, "material.nu=0.3,0.4"), tmp_path, 1)
    assert not store.rows
    assert all(row["outcome"] == "LookupError: no such body" for row in store.lost.values())


SETTINGS = (
    "model.domain=plane-strain",
    "mesh.size_mm=4",
    "mesh.base_size_mm=16",
    "press.steps=10",
    "effects.auto=false",
)
COARSE = [word for setting in SETTINGS for word in ("--set", setting)]
SLOW = ("--set", "press.steps=200")
"""Makes a point take some tenths of a second, so that a sweep of few points is still running when a signal comes."""


def lines(out: Path) -> list[dict]:
    path = out / "points.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines() if line.endswith("}")] if path.exists() else []


def environment(root: Path, cache: str) -> dict[str, str]:
    # PYTHONPATH stands for an installation; the folder they run in does not matter
    return {**os.environ, "PYTHONPATH": str(root), "FINGER3D_CACHE": cache, "OMP_NUM_THREADS": "1"}


@contextmanager
def started(command: list[str], env: dict[str, str], where: Path, log: Path) -> Iterator[subprocess.Popen]:
    with log.open("w") as file:
        process = subprocess.Popen(command, env=env, cwd=where, stdout=file, stderr=file, start_new_session=True)
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()
            process.wait()


def until(true: Callable[[], bool], what: str, seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, f"{what}: not within {seconds} s"
        time.sleep(0.02)


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def sweeping(paper_scene: Path, out: Path, mus: int, nus: int, *more: str) -> list[str]:
    """Return the command of a sweep of mus times nus points."""
    mu = ",".join(f"{0.02 + 1.0 * i / mus:.4f}" for i in range(mus))
    nu = ",".join(f"{0.3 + 0.19 * i / nus:.4f}" for i in range(nus))
    command = [sys.executable, "-m", "finger3d", "sweep", str(paper_scene), *COARSE, "--out", str(out)]
    return [*command, "--vary", f"friction.mu={mu}", "--vary", f"material.nu={nu}", *more]


def assert_nothing_repeated_or_lost(out: Path, total: int) -> None:
    assert sorted(row["point"] for row in lines(out)) == list(range(total))
    found = table(out)
    assert [int(row["point"]) for row in found] == list(range(total))
    assert {row["outcome"] for row in found} == {"converged"}
    assert pq.read_table(out / "results.parquet").num_rows == total


def children(pid: int) -> list[int]:
    """Processes that a process, or one of its threads, has started, by Linux's process table."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return list(dict.fromkeys(int(n) for task in tasks for n in (task / "children").read_text().split()))


def workers_of(pid: int) -> list[int]:
    """Worker processes of a sweep on this machine."""
    return [n for n in children(pid) if "popen_loky" in Path(f"/proc/{n}/cmdline").read_text()]


def killed_and_resumed(command: list[str], out: Path, total: int, env: dict[str, str], where: Path) -> None:
    """Kill a worker, then the parent, then continue; the journal's lines are counted over both runs."""
    log = where / "sweep.log"
    with started(command, env, where, log) as parent:
        until(lambda: len(lines(out)) >= total // 10, "a tenth of the points")
        workers = workers_of(parent.pid)
        assert len(workers) == 2
        os.kill(workers[0], signal.SIGKILL)
        count = len(lines(out))
        until(lambda: len(lines(out)) >= count + total // 5 or parent.poll() is not None, "points after the kill")
        parent.kill()
        parent.wait()
    before = lines(out)
    assert total // 10 <= len(before) < total, log.read_text()
    until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers), "workers end with their parent")
    with started(command, env, where, log) as parent:
        assert parent.wait(timeout=250) == 0, log.read_text()
    # what was kept is the beginning of what is there: none was pressed again
    assert lines(out)[: len(before)] == before


@pytest.mark.slow
def test_a_sweep_survives_kill_9_of_a_worker_and_of_the_parent(root, paper_scene, tmp_path) -> None:
    out = tmp_path / "out"
    env = environment(root, str(tmp_path))
    killed_and_resumed(sweeping(paper_scene, out, 30, 4, "--workers", "2"), out, 120, env, tmp_path)
    assert_nothing_repeated_or_lost(out, 120)


@contextmanager
def dask(
    workers: int, env: dict[str, str], where: Path, *options: str
) -> Iterator[tuple[str, subprocess.Popen, list[subprocess.Popen]]]:
    """Address and process of a scheduler, and the processes of its workers."""
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    here = [sys.executable, "-m"]
    scheduler = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    worker = ["distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard", *(options or ["--no-nanny"])]
    with ExitStack() as running:
        process = running.enter_context(started([*here, *scheduler], env, where, where / "scheduler.log"))
        logs = [where / f"worker{i}.log" for i in range(workers)]
        yield address, process, [running.enter_context(started([*here, *worker], env, where, log)) for log in logs]


@pytest.mark.slow
def test_a_scheduler_and_two_workers_of_their_own(root, paper_scene, tmp_path) -> None:
    env, out = environment(root, str(tmp_path)), tmp_path / "out"
    with dask(2, env, tmp_path) as (address, *_):
        command = sweeping(paper_scene, out, 3, 4, "--scheduler", address)
        # the scheduler may still be on its way: the time limit is there for that, too
        done = subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""
    assert_nothing_repeated_or_lost(out, 12)
    assert {row["body"] for row in lines(out)} == {p.body for p in load_points(paper_scene)}


@pytest.mark.slow
@pytest.mark.parametrize("labels", [(), ("--set", "labels.grid_mm=5")], ids=["plain", "labels"])
def test_a_sweep_goes_on_when_a_nanny_starts_its_worker_again(labels, root, paper_scene, tmp_path) -> None:
    """As after a death for lack of memory; Dask itself keeps the batch for the address that is gone."""
    env, out = environment(root, str(tmp_path)), tmp_path / "out"
    with dask(1, env, tmp_path, "--nanny", "--local-directory", str(tmp_path)) as (address, _, (nanny,)):
        command = sweeping(paper_scene, out, 30, 2, "--scheduler", address, *SLOW, *labels)
        with started(command, env, tmp_path, tmp_path / "log") as parent:
            until(lambda: len(lines(out)) >= 3, "three points")
            spawned = [n for n in children(nanny.pid) if "spawn_main" in Path(f"/proc/{n}/cmdline").read_text()]
            for pid in spawned:
                os.kill(pid, signal.SIGKILL)
            assert len(spawned) == 1
            assert parent.wait(timeout=200) == 0, (tmp_path / "log").read_text()
    assert_nothing_repeated_or_lost(out, 60)
    if labels:
        with h5py.File(out / "labels.h5") as file:
            samples = [file[body] for body in file]
            assert sorted(np.concatenate([body["sample"][:] for body in samples])) == list(range(60))
            assert all(np.isfinite(body["pressure_MPa"][:, -1]).any(axis=(1, 2)).all() for body in samples)


def test_a_worker_without_finger3d_is_named(root, paper_scene, tmp_path) -> None:
    env, out = environment(root, str(tmp_path)), tmp_path / "out"
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    # stands for an environment without it
    code = "import importlib.metadata as m, sys; f = m.version\n"
    code += "def version(name):\n    if name == 'finger3d': raise m.PackageNotFoundError(name)\n    return f(name)\n"
    code += "m.version = version; sys.modules['finger3d'] = None\n"
    (hidden / "sitecustomize.py").write_text(code, encoding="utf-8")
    bare = {**env, "PYTHONPATH": str(hidden)}
    with dask(1, bare, tmp_path) as (address, *_):
        command = sweeping(paper_scene, out, 3, 2, "--scheduler", address)
        done = subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 3, done.stderr
    (line,) = done.stderr.splitlines()
    assert "has no finger3d; install finger3d" in line


@pytest.mark.slow
def test_a_scheduler_that_dies_ends_a_sweep_with_3_and_one_line(root, paper_scene, tmp_path) -> None:
    env, out = environment(root, str(tmp_path)), tmp_path / "out"
    with dask(1, env, tmp_path) as (address, scheduler, _):
        command = sweeping(paper_scene, out, 60, 2, "--scheduler", address, *SLOW)
        with started(command, env, tmp_path, tmp_path / "log") as parent:
            until(lambda: len(lines(out)) >= 5, "five points")
            scheduler.send_signal(signal.SIGKILL)
            assert parent.wait(timeout=60) == 3, (tmp_path / "log").read_text()
    said = (tmp_path / "log").read_text()
    assert not [line for line in said.splitlines()[:-1] if not line.startswith("[")]
    count = len(lines(out))
    assert 5 <= count < 120
    assert f"{count} of 120 points" in said.splitlines()[-1]
    assert len(table(out)) == count


def load_points(paper_scene: Path) -> list:
    nu = ",".join(f"{0.3 + 0.19 * i / 4:.4f}" for i in range(4))
    return list(checked_points(paper_scene, SETTINGS, varied(["friction.mu=0.02", f"material.nu={nu}"])).points)


@pytest.mark.parametrize("bodies", [1, pytest.param(2, marks=pytest.mark.slow)], ids=["here", "workers"])
def test_ctrl_c_ends_with_130_and_one_line(bodies, root, paper_scene, tmp_path) -> None:
    out = tmp_path / "out"
    command = sweeping(paper_scene, out, 120 // bodies, bodies, "--workers", str(bodies), *SLOW)
    with started(command, environment(root, str(tmp_path)), tmp_path, tmp_path / "log") as parent:
        until(lambda: len(lines(out)) >= 5, "five points")
        # a terminal sends it to the workers, too
        os.killpg(parent.pid, signal.SIGINT)
        assert parent.wait(timeout=60) == 130
    said = (tmp_path / "log").read_text()
    assert "Traceback" not in said
    count = len(lines(out))
    assert 5 <= count < 120
    assert said.splitlines()[-1].startswith(f"finger3d: interrupted; {count} of 120 points")
    assert len(table(out)) == count


def test_a_body_that_cannot_be_built_and_a_point_that_fails_are_rows(paper_scene, monkeypatch) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1")

    def fails(*arguments: object, **settings: object) -> None:
        raise Finger3dError("no mesh")

    monkeypatch.setattr(worker, "SharedBody", fails)
    assert [row["outcome"] for row in pressed_here(sweep)] == ["no mesh", "no mesh"]

    class Weak:
        seconds = 0.0

        def presses(self, variants: list, most: int | None) -> list:
            return [MemoryError() for _ in variants]

    monkeypatch.setattr(worker, "SharedBody", lambda *a, **k: Weak())
    assert [row["outcome"] for row in pressed_here(sweep)] == ["MemoryError: no further information"] * 2


def test_a_worker_with_other_source_presses_nothing(paper_scene) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06")
    (spec,) = sweep.bodies.values()
    with pytest.raises(Finger3dError, match="not the one that the sweep was started with"):
        worker.batch(replace(spec, key="other"), sweep.points, 1)
    assert worker.batch(spec, sweep.points, 1)[0]["outcome"] == "converged"
