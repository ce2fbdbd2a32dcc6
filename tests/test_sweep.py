"""Sweeps: points and refusals, what is kept through kills and a full disk, a cluster of separate processes."""

from __future__ import annotations

import csv
import errno
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from finger3d.cli import main
from finger3d.errors import Finger3dError, MissingError
from finger3d.scene import load
from finger3d.sweep import Kept, Sweep, combinations
from finger3d.sweep import run as running
from finger3d.sweep.points import Vary
from finger3d.sweep.work import press_all

COARSE = ["--set", "model.domain=plane-strain", "--set", "mesh.size_mm=4", "--set", "mesh.base_size_mm=16"]
SETS = COARSE[1::2]


@pytest.fixture
def scene(root: Path) -> Path:
    return root / "geometries" / "fig9.toml"


def points_of(scene: Path, *vary: str) -> Sweep:
    return combinations(scene, SETS, vary)


def pressed_here(sweep: Sweep) -> list[dict]:
    """Rows of all points, without Dask."""
    rows: list[dict] = []
    for key, body in sweep.bodies.items():
        press_all((key, body, [(p.number, p.variant) for p in sweep.points if p.body == key]), rows.append)
    return rows


def lines(out: Path) -> list[dict]:
    path = out / "points.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def table(out: Path) -> list[dict]:
    with (out / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_combination_is_a_point_and_only_the_material_makes_bodies(scene):
    sweep = points_of(scene, "friction.mu=0.06,0.25", "material.nu=0.45,0.49", "gauge.g36.angle_deg=10,20")
    assert [p.number for p in sweep.points] == list(range(8))
    assert sweep.points[1].values == {"friction.mu": 0.06, "material.nu": 0.45, "gauge.g36.angle_deg": 20}
    assert len(sweep.bodies) == 2


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("friction.mu=0.06, 0.25,1", (0.06, 0.25, 1)),
        ("model.domain=solid,plane-strain", ("solid", "plane-strain")),
        ("effects.viscosity.prony=[[0.3,0.5]],[[0.1,1.0],[0.2,2.0]]", ([[0.3, 0.5]], [[0.1, 1.0], [0.2, 2.0]])),
        ('title="a,b",c', ("a,b", "c")),
    ],
)
def test_values_are_told_apart_by_commas_outside_brackets_and_quotes(text, values):
    assert Vary.of(text).values == values


@pytest.mark.parametrize(
    ("vary", "expected"),
    [
        (["friction.mu"], "must be KEY=VALUE"),
        (["friction.mu="], "a value is empty"),
        (["friction.mu=0.1,,2"], "a value is empty"),
        (["friction.mu=0.1,0.1"], 'the value "0.1" is given twice'),
        (["friction.mu=0.1", "friction.mu=2"], "--vary friction.mu: given twice"),
        (["gauge.g36.x_mm=1", "gauge.0.x_mm=2"], "given twice"),
        (["material.n=0.1"], "with --vary material.n: material.n = 0.1: no such key"),
        (["finger.radus_mm=90"], 'did you mean "radius_mm"?'),
        (["frictoin.mu=0.1"], 'did you mean "friction"?'),
        (["friction.mu=0.1,-2"], "friction.mu = -2: must be a number from 0 up"),
        (["material.nu=0.3,0.6"], "material.nu = 0.6: must be a number from 0 to 0.5"),
        (["material.nu=0.3", "friction.mu=nan"], "friction.mu = nan: must be"),
        (["gauge.g37.x_mm=1"], 'no gauge "g37"; did you mean "g36"?'),
        (["gauge.7.x_mm=1"], '--vary gauge.7.x_mm: no item "7"'),
        (["mesh={tolerance=0.05}"], "give a sweep mesh.size_mm"),
        (["gauge.g36.x_mm=1,70"], "is outside the finger"),
        ([f"friction.mu={','.join(map(str, range(400)))}", f"material.nu={','.join(map(str, range(400)))}"], "160000"),
    ],
)
def test_bad_values_are_refused_before_the_first_run(vary, expected, scene, tmp_path, capsys):
    options = [option for text in vary for option in ("--vary", text)]
    assert main(["sweep", str(scene), *COARSE, *options, "--out", str(tmp_path / "out")]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert expected in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "code", "expected"),
    [
        (["--workers", "0"], 2, "must be at least 1"),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"], 2, "give one of them"),
        (["--scheduler", "here"], 2, "must be HOST:PORT"),
        (["--scheduler", "tcp://127.0.0.1:1"], 3, "no Dask scheduler answered within"),
    ],
)
def test_a_cluster_that_cannot_be_used_is_told_in_one_line(
    options, code, expected, scene, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr("finger3d.sweep.cluster.CONNECT_S", 1.0)
    arguments = ["sweep", str(scene), *COARSE, "--vary", "friction.mu=0.1", "--out", str(tmp_path / "out"), *options]
    assert main(arguments) == code
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert expected in err


def test_a_scheduler_that_does_not_answer_is_left_after_the_time_limit(scene, tmp_path, monkeypatch):
    monkeypatch.setattr("finger3d.sweep.cluster.CONNECT_S", 1.0)
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        address = f"tcp://127.0.0.1:{deaf.getsockname()[1]}"
        start = time.monotonic()
        with pytest.raises(MissingError, match="no Dask scheduler answered"):
            running.sweep(points_of(scene, "friction.mu=0.1"), tmp_path, scheduler=address)
        assert time.monotonic() - start < 10.0


def test_rows_become_a_table_in_the_scenes_own_names(scene, tmp_path):
    sweep = points_of(scene, "friction.mu=0.06,1", "contact.rule=projection,paper")
    rows = pressed_here(sweep)
    with Kept(sweep, tmp_path).open() as kept:
        for row in rows[:3]:
            assert kept.add(row)
        assert not kept.add(rows[0])
        kept.lose(3, "its worker died")
        kept.write()
        assert kept.left() == [3]
    found = pq.read_table(tmp_path / "results.parquet").to_pylist()
    assert [row["point"] for row in found] == [0, 1, 2, 3]
    assert found[2]["friction.mu"] == 1.0
    assert found[1]["contact.rule"] == "paper"
    assert found[0]["normal_force_N"] == rows[0]["normal_force_N"] > 0.0
    assert {"gauge_g36", "outcome", "residual", "seconds"} <= set(found[0])
    assert found[3]["outcome"] == "its worker died"
    assert found[3]["normal_force_N"] != found[3]["normal_force_N"]
    # the CSV keeps every digit
    assert float(table(tmp_path)[0]["normal_force_N"]) == rows[0]["normal_force_N"]


def test_a_torn_line_is_dropped_and_its_point_done_again(scene, tmp_path):
    sweep = points_of(scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    with Kept(sweep, tmp_path).open() as kept:
        kept.add(rows[0])
    journal = tmp_path / "points.jsonl"
    whole = journal.read_text()
    journal.write_text(whole + json.dumps(rows[1])[:50])
    with Kept(sweep, tmp_path).open() as kept:
        assert kept.left() == [1]
        kept.add(rows[1])
    assert lines(tmp_path) == rows


def test_a_folder_of_another_sweep_is_refused(scene, tmp_path, capsys):
    with Kept(points_of(scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    arguments = ["sweep", str(scene), *COARSE, "--vary", "friction.mu=0.06,2", "--out", str(tmp_path)]
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert "holds another sweep (its friction.mu is 0.06,1)" in err


@pytest.mark.parametrize(
    ("vary", "expected"),
    [
        (["friction.mu=0.06,1", "material.nu=0.4"], "does not vary material.nu"),
        (["material.nu=0.4"], "its friction.mu is 0.06,1"),
    ],
)
def test_what_makes_it_another_sweep_is_named(vary, expected, scene, tmp_path):
    with Kept(points_of(scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    with pytest.raises(Finger3dError, match=expected), Kept(points_of(scene, *vary), tmp_path).open():
        pass
    other = combinations(scene, [*SETS, "press.steps=3"], ["friction.mu=0.06,1"])
    with pytest.raises(Finger3dError, match="of another scene"), Kept(other, tmp_path).open():
        pass


def test_a_folder_in_use_is_refused(scene, tmp_path):
    sweep = points_of(scene, "friction.mu=0.06")
    with Kept(sweep, tmp_path).open(), pytest.raises(Finger3dError, match="a sweep is running there"):
        with Kept(sweep, tmp_path).open():
            pass


@pytest.mark.parametrize("name", ["points.jsonl", "results.parquet"])
def test_a_full_disk_is_one_line_that_says_what_is_kept(name, scene, tmp_path, monkeypatch):
    sweep = points_of(scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    kept = Kept(sweep, tmp_path)
    with kept.open():
        kept.add(rows[0])
        if name == "results.parquet":
            real = os.replace

            def full(source: object, target: object) -> None:
                if str(target).endswith(".parquet"):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                real(source, target)

            monkeypatch.setattr(os, "replace", full)
            act = kept.write
        else:
            real_stream = kept._stream

            class Full:
                def write(self, line: bytes) -> int:
                    # what a disk does that is nearly full: it takes a part
                    return real_stream.write(line[:20])

                close = real_stream.close

            kept._stream = Full()
            act = lambda: kept.add(rows[1])  # noqa: E731
        with pytest.raises(MissingError, match=r"No space left on device; 1 of 2 points are kept") as told:
            act()
    assert name in str(told.value)
    with Kept(sweep, tmp_path).open() as again:
        assert again.left() == [1]


def test_a_body_that_cannot_be_built_and_a_point_that_fails_are_rows(scene, monkeypatch):
    sweep = points_of(scene, "friction.mu=0.06,1")
    monkeypatch.setattr("finger3d.sweep.work._built", lambda *a: (_ for _ in ()).throw(Finger3dError("no mesh")))
    assert [row["outcome"] for row in pressed_here(sweep)] == ["no mesh", "no mesh"]

    class Weak:
        seconds = 0.0

        def press(self, variant: object) -> None:
            raise MemoryError

    monkeypatch.setattr("finger3d.sweep.work._built", lambda *a: Weak())
    assert [row["outcome"] for row in pressed_here(sweep)] == ["MemoryError: no further words"] * 2


# --- real processes ---


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


def until(true, what: str, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, f"{what}: not within {seconds} s"
        time.sleep(0.02)


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def sweeping(scene: Path, out: Path, mus: int, nus: int, *more: str) -> list[str]:
    mu = ",".join(f"{0.02 + 1.0 * i / mus:.4f}" for i in range(mus))
    nu = ",".join(f"{0.3 + 0.19 * i / nus:.4f}" for i in range(nus))
    command = [sys.executable, "-m", "finger3d", "sweep", str(scene), *COARSE, "--out", str(out)]
    return [*command, "--vary", f"friction.mu={mu}", "--vary", f"material.nu={nu}", *more]


def nothing_repeated_or_lost(out: Path, total: int) -> None:
    assert sorted(row["point"] for row in lines(out)) == list(range(total))
    found = table(out)
    assert [int(row["point"]) for row in found] == list(range(total))
    assert {row["outcome"] for row in found} == {"converged"}
    assert pq.read_table(out / "results.parquet").num_rows == total


def children(pid: int) -> list[int]:
    """Worker processes of a parent, by Linux's process table."""
    mine = [int(n) for n in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    for task in Path(f"/proc/{pid}/task").iterdir():
        mine += [int(n) for n in (task / "children").read_text().split()]
    return [n for n in dict.fromkeys(mine) if "spawn_main" in Path(f"/proc/{n}/cmdline").read_text()]


def killed_and_resumed(command: list[str], out: Path, total: int, env: dict[str, str], where: Path) -> None:
    """Kill -9 a worker, then the parent, then go on; the journal's lines are counted over both runs."""
    log = where / "sweep.log"
    with started(command, env, where, log) as parent:
        until(lambda: len(lines(out)) >= total // 10, "a tenth of the points")
        workers = children(parent.pid)
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
    nothing_repeated_or_lost(out, total)


def test_a_sweep_survives_kill_9_of_a_worker_and_of_the_parent(root, scene, tmp_path):
    out = tmp_path / "out"
    env = environment(root, str(tmp_path))
    killed_and_resumed(sweeping(scene, out, 20, 3, "--workers", "2"), out, 60, env, tmp_path)


@pytest.mark.slow
def test_a_thousand_points_survive_kill_9(root, scene, tmp_path):
    out = tmp_path / "out"
    env = environment(root, str(tmp_path))
    killed_and_resumed(sweeping(scene, out, 50, 20, "--workers", "2"), out, 1000, env, tmp_path)


def test_a_scheduler_and_two_workers_of_their_own(root, scene, tmp_path):
    port, env, out = free_port(), environment(root, str(tmp_path)), tmp_path / "out"
    address = f"tcp://127.0.0.1:{port}"
    here = [sys.executable, "-m"]
    with ExitStack() as running_:
        command = [
            *here,
            "distributed.cli.dask_scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            str(port),
            "--no-dashboard",
        ]
        running_.enter_context(started(command, env, tmp_path, tmp_path / "scheduler.log"))
        for i in range(2):
            command = [*here, "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
            running_.enter_context(started(command, env, tmp_path, tmp_path / f"worker{i}.log"))
        command = sweeping(scene, out, 3, 4, "--scheduler", address)
        # the scheduler may still be on its way: the time limit is there for that, too
        done = subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""
    nothing_repeated_or_lost(out, 12)
    assert {row["body"] for row in lines(out)} == {p.body for p in load_points(scene)}


def load_points(scene: Path) -> list:
    nu = ",".join(f"{0.3 + 0.19 * i / 4:.4f}" for i in range(4))
    return list(points_of(scene, "friction.mu=0.02", f"material.nu={nu}").points)


def test_ctrl_c_ends_with_130_and_one_line(root, scene, tmp_path):
    out = tmp_path / "out"
    command = sweeping(scene, out, 100, 1, "--workers", "1")
    with started(command, environment(root, str(tmp_path)), tmp_path, tmp_path / "log") as parent:
        until(lambda: len(lines(out)) >= 5, "five points")
        # a terminal sends it to the workers, too
        os.killpg(parent.pid, signal.SIGINT)
        assert parent.wait(timeout=60) == 130
    said = (tmp_path / "log").read_text()
    assert "Traceback" not in said
    count = len(lines(out))
    assert 5 <= count < 100
    assert said.splitlines()[-1].startswith(f"finger3d: interrupted; {count} of 100 points are kept in {out}")
    assert len(table(out)) == count


def test_the_scene_of_these_tests_is_small(scene):
    assert load(scene, SETS).mesh.size_mm == 4.0
