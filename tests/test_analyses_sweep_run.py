"""Sweeps: their tables, folders and interruptions."""

from __future__ import annotations

import errno
import subprocess
import sys

import pyarrow.parquet as pq
import pytest

from finger3d.analyses.sweep import run as running
from finger3d.analyses.sweep.store import ResultStore
from finger3d.cli import main
from finger3d.errors import Finger3dError, MissingError
from finger3d.results.journal import Journal, Row
from finger3d.scene import load
from tests.sweep_cases import COARSE, SETS, lines, points_of, pressed_here, table


def test_rows_become_a_table_in_the_scenes_own_names(paper_scene, tmp_path) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1", "contact.rule=projection,paper")
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


def test_a_folder_in_use_is_refused(paper_scene, tmp_path) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06")
    with ResultStore(sweep, tmp_path).open(), pytest.raises(Finger3dError, match="writing"):
        with ResultStore(sweep, tmp_path).open():
            pass


def test_a_sweep_of_one_body_needs_neither_dask_nor_matplotlib(paper_scene, tmp_path) -> None:
    code = "import sys; from finger3d.cli import main; main(sys.argv[1:]); "
    code += "sys.exit(repr({'matplotlib', 'distributed'} & set(sys.modules)))"
    words = ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.1,0.2", "--out", str(tmp_path)]
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=120)
    assert done.stderr.splitlines()[-1] == "set()"
    assert 'class="chart"' in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_point_whose_row_is_written_at_an_interruption_is_counted(paper_scene, tmp_path, monkeypatch, capsys) -> None:
    append = Journal.append

    def interrupted(journal: Journal, row: Row) -> None:
        append(journal, row)
        if len(journal.rows) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(Journal, "append", interrupted)
    words = ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.1,0.2,0.3", "--out", str(tmp_path)]
    assert main(words) == 130
    assert "2 of 3 points" in capsys.readouterr().err
    assert len(lines(tmp_path)) == len(table(tmp_path)) == 2


def test_the_scene_of_these_tests_is_small(paper_scene) -> None:
    assert load(paper_scene, SETS).mesh.size_mm == 4.0


def test_one_worker_is_this_process(paper_scene, tmp_path, monkeypatch) -> None:
    """It needs no shared memory, which a container may lack."""

    def none(*arguments: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr("finger3d.analyses.sweep.local._pool", none)
    sweep = points_of(paper_scene, "material.nu=0.3,0.4")
    with pytest.raises(MissingError, match="Read-only file system; --workers 1 "):
        running.press_points(sweep, tmp_path, workers=2)
    assert sorted(running.press_points(sweep, tmp_path, workers=1).rows) == [0, 1]
