"""The journal of a resumable task: rows survive an interruption, other tasks and damaged lines are refused."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from finger3d._machine import made_with
from finger3d.errors import Finger3dError, MissingError
from finger3d.results import journal
from finger3d.results.journal import Journal, Row, number_in, opened

TASK = {"scene": {"mu": 0.5}, "points": 3}


def rows_of(folder: Path, *more: Row, task: dict = TASK) -> list[Row]:
    """Open the journal, append rows, and return all of them."""
    with opened(folder / "rows.jsonl", folder / "task.json", task) as kept:
        for row in more:
            kept.append(row)
        return kept.rows


def test_the_same_task_continues_after_its_rows(tmp_path) -> None:
    assert rows_of(tmp_path, {"n": 0}, {"n": 1 / 3}) == [{"n": 0}, {"n": 1 / 3}]
    assert rows_of(tmp_path, {"n": 2}) == [{"n": 0}, {"n": 1 / 3}, {"n": 2}]
    assert math.isnan(number_in(rows_of(tmp_path, {"n": math.nan})[-1], "n"))


def test_a_line_that_was_cut_short_is_removed(tmp_path) -> None:
    rows_of(tmp_path, {"n": 0})
    path = tmp_path / "rows.jsonl"
    path.write_text(path.read_text() + '{"n": 1, "na')
    assert rows_of(tmp_path, {"n": 2}) == [{"n": 0}, {"n": 2}]
    assert [json.loads(line)["n"] for line in path.read_text().splitlines()] == [0, 2]


def test_another_task_is_refused_and_its_rows_stay(tmp_path) -> None:
    rows_of(tmp_path, {"n": 0})
    with pytest.raises(Finger3dError, match="task"):
        rows_of(tmp_path, task={**TASK, "points": 4})
    (tmp_path / "task.json").unlink()
    with pytest.raises(Finger3dError, match=r"rows.jsonl .*task.json"):
        rows_of(tmp_path)
    assert [json.loads(line)["n"] for line in (tmp_path / "rows.jsonl").read_text().splitlines()] == [0]


@pytest.mark.parametrize(
    ("line", "edit"),
    [
        (2, lambda a, b, c: [a, "[1]\n", c]),
        (2, lambda a, b, c: [a, "[" * 100_000 + "\n", c]),
        (2, lambda a, b, c: [a, b.replace("0.25", "0.26"), c]),
        (2, lambda a, b, c: [a, b.replace("0.25", "NaN"), c]),
        (2, lambda a, b, c: [a, b[:-9] + "\n", c]),
        (2, lambda a, b, c: [a, c, b]),
        (2, lambda a, b, c: [a, a, b, c]),
        (2, lambda a, b, c: [a, c]),
        (1, lambda a, b, c: [b, c]),
        (4, lambda a, b, c: [a, b, c, "\n"]),
    ],
)
def test_the_first_damaged_line_is_named_and_nothing_is_lost(line: int, edit: Callable, tmp_path) -> None:
    rows_of(tmp_path, {"n": 0}, {"n": 0.25}, {"n": 2, "x": [math.nan, None]})
    path = tmp_path / "rows.jsonl"
    before = path.read_text()
    path.write_text("".join(edit(*before.splitlines(keepends=True))))
    damaged = path.read_text()
    with pytest.raises(Finger3dError, match=rf"rows.jsonl: line {line}: .*remove it and all lines below"):
        rows_of(tmp_path)
    assert path.read_text() == damaged
    # as the message says
    path.write_text("".join(damaged.splitlines(keepends=True)[: line - 1]))
    assert [row["n"] for row in rows_of(tmp_path)] == [0, 0.25, 2][: line - 1]


def test_a_journal_of_another_task_is_damaged(tmp_path) -> None:
    rows_of(tmp_path / "a", {"n": 0})
    rows_of(tmp_path / "b", task={"points": 3})
    (tmp_path / "b" / "rows.jsonl").write_bytes((tmp_path / "a" / "rows.jsonl").read_bytes())
    with pytest.raises(Finger3dError, match=r"rows.jsonl: line 1: "):
        rows_of(tmp_path / "b", task={"points": 3})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"files": {"/finger.step": "2"}}, "/finger.step has changed since"),
        ({"files": {"/finger.step": "1", "/coin.stl": "1"}}, "/coin.stl has changed since"),
        ({"points": 4}, "another task;"),
    ],
)
def test_what_has_changed_is_named(changes: dict, said: str, tmp_path) -> None:
    task = {**TASK, "files": {"/finger.step": "1"}}
    rows_of(tmp_path, {"n": 0}, task=task)
    with pytest.raises(Finger3dError, match=said):
        rows_of(tmp_path, task={**task, **changes})


@pytest.mark.parametrize("name", ["numpy", "the source of finger3d and its designs"])
def test_rows_made_with_other_packages_or_other_source_are_refused(name: str, tmp_path, monkeypatch) -> None:
    rows_of(tmp_path, {"n": 0})
    monkeypatch.setattr(journal, "made_with", lambda: {**made_with(), name: "other"})
    with pytest.raises(Finger3dError, match=f"{name} has changed since"):
        rows_of(tmp_path)


def test_a_full_disk_is_an_error_of_the_row_that_does_not_fit() -> None:
    full = Journal(Path("/dev/full"), [])
    with pytest.raises(MissingError, match="/dev/full: No space left on device; make room"):
        full.append({"n": 0})
    assert not full.rows
    full.close()
