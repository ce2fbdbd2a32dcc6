"""Files are whole, exact, and read by the programs they are made for."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from finger3d.errors import Finger3dError, Outcome
from finger3d.io import atomic, claimed, holds, write_csv, write_json


def test_csv_keeps_every_digit(tmp_path: Path) -> None:
    x = np.array([0.1, 1 / 3, 1e-300, -2.5e17])
    write_csv(tmp_path / "t.csv", {"x_mm": x, "status": np.array(["open", "stick", "slip", "a,b"]), "n": np.arange(4)})
    with (tmp_path / "t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(r["x_mm"]) for r in rows] == x.tolist()
    assert [r["status"] for r in rows] == ["open", "stick", "slip", "a,b"]
    assert [r["n"] for r in rows] == ["0", "1", "2", "3"]


def test_csv_refuses_columns_of_different_length(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="shape"):
        write_csv(tmp_path / "t.csv", {"a": np.zeros(3), "b": np.zeros(2)})
    assert list(tmp_path.iterdir()) == []


def test_json_takes_arrays_and_has_no_nan(tmp_path: Path) -> None:
    data = {"a": np.array([1.5, np.nan]), "b": np.float64(1 / 3), "c": (np.int64(2), Outcome.CONVERGED), "d": None}
    write_json(tmp_path / "s.json", data)
    text = (tmp_path / "s.json").read_text()
    assert json.loads(text) == {"a": [1.5, None], "b": 1 / 3, "c": [2, "converged"], "d": None}
    assert "NaN" not in text


def test_atomic_leaves_the_old_file_when_the_block_fails(tmp_path: Path) -> None:
    target = tmp_path / "result.txt"
    target.write_text("old")

    def write_half() -> None:
        with atomic(target) as temporary:
            temporary.write_text("half")
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        write_half()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_atomic_replaces_and_keeps_usual_permissions(tmp_path: Path) -> None:
    target = tmp_path / "new" / "result.txt"
    for text in ("one", "two"):
        with atomic(target) as temporary:
            assert temporary.suffix == ".txt"
            temporary.write_text(text)
    plain = tmp_path / "plain"
    plain.touch()
    assert target.read_text() == "two"
    assert list(target.parent.iterdir()) == [target]
    assert os.stat(target).st_mode == os.stat(plain).st_mode


def test_what_a_killed_process_has_left_is_removed_by_the_next_run(tmp_path: Path) -> None:
    """A process that is killed while it writes, as by kill -9, cannot tidy up."""
    program = (
        "import os, signal, sys; from finger3d.io import atomic\n"
        "blocks = [atomic(name) for name in sys.argv[1:]]\n"
        "for block in blocks: block.__enter__().write_text('half')\n"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    mine = [tmp_path / "out" / name for name in ("report[1].html", "fields.vtu")]
    subprocess.run([sys.executable, "-c", program, *mine], check=False, cwd=Path(__file__).parent.parent)
    (tmp_path / "out" / ".vimrc").write_text("")
    assert len(list((tmp_path / "out").iterdir())) == 3
    # another process may be writing the same file now: only what is old goes
    write_json(mine[0], {})
    (half,) = (tmp_path / "out").glob(".report*")
    os.utime(half, (0, 0))
    write_json(mine[0], {})
    assert not list((tmp_path / "out").glob(".report*"))
    with claimed(tmp_path / "out"):
        assert {p.name for p in (tmp_path / "out").iterdir()} == {".finger3d.lock", ".vimrc", "report[1].html"}


def test_links_that_lead_in_a_circle_hold_nothing(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    (tmp_path / "scene.toml").write_text("")
    (tmp_path / "link.toml").symlink_to("scene.toml")
    assert holds(tmp_path, ["x", "scene.toml"], tmp_path / "link.toml")
    assert not holds(tmp_path / "a", ["scene.toml"], tmp_path / "scene.toml")


def test_a_folder_that_cannot_be_written_is_a_users_mistake(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(Finger3dError, match=r"file/s\.json: ") as caught:
        write_json(tmp_path / "file" / "s.json", {})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("file", "command"), [("identify.json", "identify"), ("gauges.json", "optimise")])
def test_a_folder_with_the_results_of_another_command_is_refused(tmp_path: Path, file: str, command: str) -> None:
    (tmp_path / file).touch()
    with claimed(tmp_path, command):
        pass
    with pytest.raises(Finger3dError, match=command), claimed(tmp_path, "press"):
        pass


def test_a_folder_into_which_nothing_was_written_goes_with_those_made_for_it(tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    with claimed(mine / "a" / "b") as folder:
        assert folder.is_dir()
    assert list(mine.iterdir()) == []
    # one that was there stays, and so does one that holds something
    with claimed(mine):
        pass
    with claimed(mine / "c") as folder:
        (folder / "result").touch()
    assert mine.is_dir()
    assert (mine / "c" / "result").exists()
