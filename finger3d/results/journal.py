"""Resumable tasks: rows that are appended to a file as soon as they are known.

A task of many steps keeps two files in its folder: one that identifies the task, and one JSON line for each finished
step.  Running the same task again reads the lines and continues after them.  Every line has a checksum of itself, the
lines above it and the task.
"""

from __future__ import annotations

import errno
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from finger3d._machine import made_with
from finger3d._types import TreeView
from finger3d.errors import Finger3dError
from finger3d.io import atomic, cannot_write, checksum, write_json
from finger3d.results.summary import read_json

Row = TreeView


class Journal:
    """The finished steps of a task.

    Attributes
    ----------
    path : file with one JSON object a line
    rows : rows read from the file when it was opened, and those appended since
    task : checksum of the task
    last : checksum of the last row, or of the task
    """

    def __init__(self, path: Path, rows: list[Row], task: str = "", last: str = "") -> None:
        self.path, self.rows, self.task, self.last = path, rows, task, last
        # unbuffered: a full disk is noticed at the row that does not fit
        self._file = path.open("ab", buffering=0)

    def append(self, row: Row) -> None:
        """Append a row to the file.

        Raises
        ------
        Finger3dError
            If it cannot be written in full; a MissingError if the disk is full.
        """
        last = checksum(row, self.last)
        line = _line(row, last)
        try:
            if self._file.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise cannot_write(self.path, error) from error
        self.last = last
        self.rows.append(row)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def opened(
    path: Path,
    task_path: Path,
    task: Mapping[str, object],
    difference: Callable[[Mapping[str, object], Mapping[str, object]], str] = lambda found, wanted: "",
) -> Iterator[Journal]:
    """Open the journal of a task, new or to be continued.

    A line that an interruption cut short is removed.

    Parameters
    ----------
    path : file of the rows
    task_path : JSON file that identifies the task
    task : everything that must be equal for rows to be used again; versions and source code are added, and a change of
        ``task["files"]``, a hash by file, is told by its name
    difference : how the task found differs from the one wanted, for the error message

    Raises
    ------
    Finger3dError
        If the files belong to another task, are damaged, or cannot be written.
    """
    wanted = json.loads(json.dumps({"made_with": made_with(), **task}))
    folder, identity = path.parent, checksum(wanted)
    rows: list[tuple[Row, str]] = []
    if task_path.exists():
        found = read_json(task_path)
        if found != wanted:
            how = _changed(found, wanted) or difference(found, wanted)
            raise Finger3dError(
                f"--out {folder}: holds the results of another task{how and f' ({how})'}; name another folder"
            )
        rows = list(journal_rows(path, identity))
    elif path.exists():
        raise Finger3dError(f"--out {folder}: holds {path.name} without {task_path.name}; name another folder")
    with atomic(path) as temporary:
        temporary.write_bytes(b"".join(_line(row, total) for row, total in rows))
    write_json(task_path, wanted)
    journal = Journal(path, [row for row, _ in rows], identity, rows[-1][1] if rows else identity)
    try:
        yield journal
    finally:
        journal.close()


def _changed(found: Mapping[str, object], wanted: Mapping[str, object]) -> str:
    """Return which file, package or source has changed since the task that was found; empty if none has."""
    for kind in ("made_with", "files"):
        was, now = found.get(kind), wanted.get(kind)
        if isinstance(was, dict) and isinstance(now, dict):
            for name in dict.fromkeys([*was, *now]):
                if was.get(name) != now.get(name):
                    return f"{name} has changed since"
        elif was != now:
            return "made by another version of finger3d"
    return ""


def journal_rows(path: Path, task: str) -> Iterator[tuple[Row, str]]:
    """Yield each row of a file and its checksum, without a last line that was cut short.

    Raises
    ------
    Finger3dError
        If the file cannot be read, or a line is damaged, missing or out of order.
    """
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").split("\n") if path.exists() else []
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}; name another folder") from None
    last = task
    for number, line in enumerate(lines[:-1], start=1):
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):
            row = None
        if not isinstance(row, dict) or row.pop("checksum", None) != (last := checksum(row, last)):
            raise Finger3dError(
                f"{path}: line {number}: is damaged or not where it was written, by its checksum; remove it and all "
                "lines below it, and run the same command again"
            )
        yield row, last


def number_in(row: Row, name: str) -> float:
    """Return a number of a row, NaN if the row has none of that name."""
    value = row.get(name)
    return float(value) if isinstance(value, int | float) else math.nan


def _line(row: Row, total: str) -> bytes:
    return json.dumps({**row, "checksum": total}).encode() + b"\n"
