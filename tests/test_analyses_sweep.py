"""Sweeps: points and refusals, what is kept through kills and a full disk, a cluster of separate processes."""

from __future__ import annotations

import csv
import errno
import json
import os
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from finger3d.analyses.sweep import run as running
from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.points import Sweep, Vary, combinations
from finger3d.analyses.sweep.store import ResultStore
from finger3d.cli import main
from finger3d.errors import Finger3dError, MissingError
from finger3d.results.journal import Journal, Row
from finger3d.scene import load

COARSE = ["--set", "model.domain=plane-strain", "--set", "mesh.size_mm=4", "--set", "mesh.base_size_mm=16"]
SETS = COARSE[1::2]


@pytest.fixture
def scene(root: Path) -> Path:
    return root / "geometries" / "fig9.toml"


def points_of(scene: Path, *vary: str) -> Sweep:
    return combinations(scene, SETS, vary)


def pressed_here(sweep: Sweep) -> list[dict]:
    """Rows of all points, without Dask."""
    return [
        row
        for key, body in sweep.bodies.items()
        for row in worker.rows(body, [p for p in sweep.points if p.body == key])
    ]


def lines(out: Path) -> list[dict]:
    path = out / "points.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def table(out: Path) -> list[dict]:
    with (out / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_combination_is_a_point_and_only_the_material_makes_bodies(scene) -> None:
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
def test_values_are_told_apart_by_commas_outside_brackets_and_quotes(text, values) -> None:
    assert Vary.of(text).values == values


def test_a_scheduler_that_does_not_answer_is_left_after_the_time_limit(scene, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("finger3d.analyses.sweep.cluster.CONNECT_S", 1.0)
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        address = f"tcp://127.0.0.1:{deaf.getsockname()[1]}"
        start = time.monotonic()
        with pytest.raises(MissingError, match="no Dask scheduler answered"):
            running.sweep(points_of(scene, "friction.mu=0.1"), tmp_path, scheduler=address)
        assert time.monotonic() - start < 10.0


def test_rows_become_a_table_in_the_scenes_own_names(scene, tmp_path) -> None:
    sweep = points_of(scene, "friction.mu=0.06,1", "contact.rule=projection,paper")
    rows = pressed_here(sweep)
    with ResultStore(sweep, tmp_path).open() as kept:
        for row in rows[:3]:
            kept.add(row)
        kept.lose(sweep.points[3], "its worker died")
        kept.write()
        assert kept.left() == [sweep.points[3]]
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


def test_a_torn_line_is_dropped_and_its_point_done_again(scene, tmp_path) -> None:
    sweep = points_of(scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    with ResultStore(sweep, tmp_path).open() as kept:
        kept.add(rows[0])
    journal = tmp_path / "points.jsonl"
    whole = journal.read_text()
    journal.write_text(whole + json.dumps(rows[1])[:50])
    with ResultStore(sweep, tmp_path).open() as kept:
        assert kept.left() == [sweep.points[1]]
        kept.add(rows[1])
    assert lines(tmp_path) == rows


def edited(row: dict, **changes: object) -> str:
    return json.dumps({k: v for k, v in {**row, **changes}.items() if v != "missing"})


EDITS = [
    {"point": p} for p in (None, "0", 0.5, True, -1, 7, [], {}, "missing", 10**400)
] + [{"body": b} for b in (None, 5, "another", "missing")] + [{"outcome": o} for o in (None, 5, [], "missing")] + [
    {"normal_force_N": v} for v in (None, "5", "", [], {}, True, 10**400, float("nan"), "missing")
] + [{"gauge_g36": "5"}, {"a b": []}]  # fmt: skip


def test_a_journal_edited_by_hand_is_one_line(scene, tmp_path, capsys) -> None:
    sweep = points_of(scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    with ResultStore(sweep, tmp_path).open() as kept:
        for row in rows:
            kept.add(row)
    journal, before = tmp_path / "points.jsonl", (tmp_path / "points.jsonl").read_text()
    command = ["sweep", str(scene), *COARSE, "--vary", "friction.mu=0.06,1", "--out", str(tmp_path)]
    for line in ["[]", "5", "null", '"a"', "[" * 100_000, *(edited(rows[1], **change) for change in EDITS)]:
        journal.write_text(before.splitlines()[0] + "\n" + line + "\n")
        assert main(command) == 2, line
        err = capsys.readouterr().err
        assert len(err.splitlines()) == 1
        assert f"{journal}: line 2: " in err
        assert "remove the line" in err
        assert journal.read_text().splitlines()[1] == line  # nothing is lost
    journal.unlink()
    journal.mkdir()
    assert main(command) == 2
    assert str(journal) in capsys.readouterr().err


def test_a_damaged_sweep_json_is_one_line(scene, tmp_path, capsys) -> None:
    with ResultStore(points_of(scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    path = tmp_path / "sweep.json"
    whole = json.loads(path.read_text())
    vary = [None, 5, [], "a", {"friction.mu": 5}, {"friction.mu": [5]}, {"friction.mu": None}]
    texts = ["", "{", "null", "5", "[]", '"a"', "{}", "[" * 100_000, *(json.dumps({**whole, "vary": v}) for v in vary)]
    for data in [*(text.encode() for text in texts), b'{"vary": "\xe9"}']:
        path.write_bytes(data)
        for command in (
            ["sweep", str(scene), *COARSE, "--vary", "friction.mu=0.06,1", "--out", str(tmp_path)],
            ["show", str(tmp_path), "--png", str(tmp_path / "a.png")],
        ):
            assert main(command) == 2, data
            err = capsys.readouterr().err
            assert len(err.splitlines()) == 1, err
            assert str(tmp_path) in err
        assert path.read_bytes() == data


@pytest.mark.parametrize("data", [b"point\n\xe9", b'point\n"' + b"a" * 200_000])
def test_a_damaged_table_is_one_line(data, tmp_path, capsys) -> None:
    (tmp_path / "sweep.json").write_text('{"vary": {"friction.mu": ["0.1", "0.2"]}}')
    (tmp_path / "results.csv").write_bytes(data)
    assert main(["show", str(tmp_path), "--png", str(tmp_path / "a.png")]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert str(tmp_path / "results.csv") in err


def test_a_folder_of_another_sweep_is_refused(scene, tmp_path, capsys) -> None:
    with ResultStore(points_of(scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    arguments = ["sweep", str(scene), *COARSE, "--vary", "friction.mu=0.06,2", "--out", str(tmp_path)]
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert 'holds the results of another task (its friction.mu is ["0.06", "1"])' in err


@pytest.mark.parametrize(
    ("vary", "expected"),
    [
        (["friction.mu=0.06,1", "material.nu=0.4"], "does not vary material.nu"),
        (["material.nu=0.4"], "its friction.mu is"),
    ],
)
def test_what_makes_it_another_sweep_is_named(vary, expected, scene, tmp_path) -> None:
    with ResultStore(points_of(scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    with pytest.raises(Finger3dError, match=expected), ResultStore(points_of(scene, *vary), tmp_path).open():
        pass
    other = combinations(scene, [*SETS, "press.steps=3"], ["friction.mu=0.06,1"])
    with pytest.raises(Finger3dError, match="of another scene"), ResultStore(other, tmp_path).open():
        pass


def test_a_folder_in_use_is_refused(scene, tmp_path) -> None:
    sweep = points_of(scene, "friction.mu=0.06")
    with ResultStore(sweep, tmp_path).open(), pytest.raises(Finger3dError, match="another finger3d is writing there"):
        with ResultStore(sweep, tmp_path).open():
            pass


def test_a_sweep_of_one_body_needs_neither_dask_nor_matplotlib(scene, tmp_path) -> None:
    code = "import sys; from finger3d.cli import main; main(sys.argv[1:]); "
    code += "sys.exit(repr({'matplotlib', 'distributed'} & set(sys.modules)))"
    words = ["sweep", str(scene), *COARSE, "--vary", "friction.mu=0.1,0.2", "--out", str(tmp_path)]
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=120)
    assert done.stderr.splitlines()[-1] == "set()"
    assert 'class="chart"' in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["points.jsonl", "results.parquet"])
def test_a_full_disk_is_one_line_that_says_what_is_kept(name, scene, tmp_path, monkeypatch) -> None:
    sweep = points_of(scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    kept = ResultStore(sweep, tmp_path)
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
            real_stream = kept._journal._file

            class Full:
                def write(self, line: bytes) -> int:
                    # what a disk does that is nearly full: it takes a part
                    return real_stream.write(line[:20])

                close = real_stream.close

            kept._journal._file = Full()
            act = lambda: kept.add(rows[1])  # noqa: E731
        with pytest.raises(MissingError, match=r"No space left on device; 1 of 2 points are kept") as told:
            act()
    assert name in str(told.value)
    with ResultStore(sweep, tmp_path).open() as again:
        assert again.left() == [sweep.points[1]]


def test_a_point_whose_row_is_written_at_an_interruption_is_counted(scene, tmp_path, monkeypatch, capsys) -> None:
    append = Journal.append

    def interrupted(journal: Journal, row: Row) -> None:
        append(journal, row)
        if len(journal.rows) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(Journal, "append", interrupted)
    words = ["sweep", str(scene), *COARSE, "--vary", "friction.mu=0.1,0.2,0.3", "--out", str(tmp_path)]
    assert main(words) == 130
    assert "2 of 3 points are kept" in capsys.readouterr().err
    assert len(lines(tmp_path)) == len(table(tmp_path)) == 2


def test_a_body_that_cannot_be_built_and_a_point_that_fails_are_rows(scene, monkeypatch) -> None:
    sweep = points_of(scene, "friction.mu=0.06,1")
    monkeypatch.setattr(
        "finger3d.analyses.sweep.worker._build", lambda *a: (_ for _ in ()).throw(Finger3dError("no mesh"))
    )
    assert [row["outcome"] for row in pressed_here(sweep)] == ["no mesh", "no mesh"]

    class Weak:
        seconds = 0.0

        def presses(self, variants: list, most: int | None) -> list:
            return [MemoryError() for _ in variants]

    monkeypatch.setattr("finger3d.analyses.sweep.worker._build", lambda *a: Weak())
    assert [row["outcome"] for row in pressed_here(sweep)] == ["MemoryError: no further information"] * 2


@pytest.mark.parametrize("threads", [1, None], ids=["a worker", "here"])
def test_workers_gain_no_threads(threads, scene, monkeypatch) -> None:
    """Two workers on two cores are as many as there is room for; a body pressed by this process takes them all."""
    pools = []

    class Pool(ThreadPoolExecutor):
        def __init__(self, most: int, **settings: object) -> None:
            pools.append(most)
            super().__init__(most, **settings)

    monkeypatch.setattr("finger3d.mechanics.parallel.ThreadPoolExecutor", Pool)
    monkeypatch.setattr("finger3d.mechanics.parallel._ROWS_FOR_THREADS", 1)
    monkeypatch.setattr("finger3d.mechanics.parallel.cores", lambda: 2)
    sweep = points_of(scene, "friction.mu=0.06,0.3,1")
    (body,) = sweep.bodies.values()
    rows = worker.batch(body, sweep.points, 3) if threads else list(worker.rows(body, sweep.points))
    assert [row["point"] for row in rows] == [0, 1, 2]
    assert {row["outcome"] for row in rows} == {"converged"}
    assert pools == ([] if threads else [2])


def test_the_scene_of_these_tests_is_small(scene) -> None:
    assert load(scene, SETS).mesh.size_mm == 4.0
