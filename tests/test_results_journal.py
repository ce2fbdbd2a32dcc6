"""The journal of a resumable task: rows survive an interruption, other tasks and damaged lines are refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from finger3d.errors import Finger3dError, MissingError
from finger3d.results.journal import Journal, Row, number_in, opened

TASK = {"scene": {"mu": 0.5}, "points": 3}


def mistake(row: object) -> str:
    return "" if isinstance(row, dict) and "n" in row else "has no n"


def rows_of(folder: Path, *more: Row, task: dict = TASK) -> list[Row]:
    """Open the journal, append rows, and return all of them."""
    with opened(folder / "rows.jsonl", folder / "task.json", task, mistake) as journal:
        for row in more:
            journal.append(row)
        return journal.rows


def test_the_same_task_continues_after_its_rows(tmp_path) -> None:
    assert rows_of(tmp_path, {"n": 0}, {"n": 1 / 3}) == [{"n": 0}, {"n": 1 / 3}]
    assert rows_of(tmp_path, {"n": 2}) == [{"n": 0}, {"n": 1 / 3}, {"n": 2}]
    assert math.isnan(number_in(rows_of(tmp_path, {"n": math.nan})[-1], "n"))


def test_a_line_that_was_cut_short_is_removed(tmp_path) -> None:
    rows_of(tmp_path, {"n": 0})
    path = tmp_path / "rows.jsonl"
    path.write_text(path.read_text() + '{"n": 1, "na')
    assert rows_of(tmp_path, {"n": 2}) == [{"n": 0}, {"n": 2}]
    assert [json.loads(line) for line in path.read_text().splitlines()] == [{"n": 0}, {"n": 2}]


def test_another_task_is_refused_and_its_rows_stay(tmp_path) -> None:
    rows_of(tmp_path, {"n": 0})
    with pytest.raises(Finger3dError, match="task"):
        rows_of(tmp_path, task={**TASK, "points": 4})
    (tmp_path / "task.json").unlink()
    with pytest.raises(Finger3dError, match=r"rows.jsonl .*task.json"):
        rows_of(tmp_path)
    assert (tmp_path / "rows.jsonl").read_text() == '{"n": 0}\n'


def test_a_row_of_another_kind_is_named_by_its_line(tmp_path) -> None:
    rows_of(tmp_path, {"n": 0})
    path = tmp_path / "rows.jsonl"
    path.write_text(path.read_text() + "[1]\n")
    with pytest.raises(Finger3dError, match=r"rows.jsonl: line 2: "):
        rows_of(tmp_path)


def test_a_full_disk_is_an_error_of_the_row_that_does_not_fit() -> None:
    journal = Journal(Path("/dev/full"), [])
    with pytest.raises(MissingError, match="/dev/full: No space left on device; make room"):
        journal.append({"n": 0})
    assert not journal.rows
    journal.close()
