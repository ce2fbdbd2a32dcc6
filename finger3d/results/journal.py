"""Resumable tasks: rows that are appended to a file as soon as they are known.

A task of many steps keeps two files in its folder: one that identifies the task, and one JSON line for each finished
step.  Running the same task again reads the lines and continues after them.
"""

from __future__ import annotations

import errno
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from finger3d.errors import Finger3dError
from finger3d.io import atomic, cannot_write, write_json
from finger3d.results.summary import read_json

Row = Mapping[str, object]


class Journal:
    """The finished steps of a task.

    Attributes
    ----------
    path : file with one JSON object a line
    rows : rows read from the file when it was opened, and those appended since
    """

    def __init__(self, path: Path, rows: list[Row]) -> None:
        self.path, self.rows = path, rows
        # unbuffered: a full disk is noticed at the row that does not fit
        self._file = path.open("ab", buffering=0)

    def append(self, row: Row) -> None:
        """Append a row to the file.

        Raises
        ------
        Finger3dError
            If it cannot be written in full; a MissingError if the disk is full.
        """
        line = _line(row)
        try:
            if self._file.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise cannot_write(self.path, error) from error
        self.rows.append(row)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def opened(
    path: Path,
    task_path: Path,
    task: Mapping[str, object],
    mistake: Callable[[object], str],
    difference: Callable[[Mapping[str, object], Mapping[str, object]], str] = lambda found, wanted: "",
) -> Iterator[Journal]:
    """Open the journal of a task, new or to be continued.

    A line that an interruption cut short is removed.

    Parameters
    ----------
    path : file of the rows
    task_path : JSON file that identifies the task
    task : everything that must be equal for rows to be used again; the version of finger3d is added
    mistake : what makes a row unfit for this task; an empty text for a good row
    difference : how the task found differs from the one wanted, for the error message

    Raises
    ------
    Finger3dError
        If the files belong to another task, are damaged, or cannot be written.
    """
    wanted = json.loads(json.dumps({"finger3d": version("finger3d"), **task}))
    folder = path.parent
    rows: list[Row] = []
    if task_path.exists():
        found = read_json(task_path)
        if found != wanted:
            how = difference(found, wanted)
            raise Finger3dError(
                f"--out {folder}: holds the results of another task{how and f' ({how})'}; name another folder"
            )
        rows = list(journal_rows(path, mistake))
    elif path.exists():
        raise Finger3dError(f"--out {folder}: holds {path.name} without {task_path.name}; name another folder")
    with atomic(path) as temporary:
        temporary.write_bytes(b"".join(map(_line, rows)))
    write_json(task_path, wanted)
    journal = Journal(path, rows)
    try:
        yield journal
    finally:
        journal.close()


def journal_rows(path: Path, mistake: Callable[[object], str]) -> Iterator[Row]:
    """Yield the rows of a file, without lines that were cut short.

    Raises
    ------
    Finger3dError
        If the file cannot be read or a row is not fit for the task, see `opened`.
    """
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").split("\n") if path.exists() else []
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}; name another folder") from None
    for number, line in enumerate(lines, start=1):
        try:
            row = json.loads(line)
        except ValueError:
            continue
        except RecursionError:
            row = None
        if reason := mistake(row):
            raise Finger3dError(f"{path}: line {number}: {reason}; remove the line and run the same command again")
        yield row


def number_in(row: Row, name: str) -> float:
    """Return a number of a row, NaN if the row has none of that name."""
    value = row.get(name)
    return float(value) if isinstance(value, int | float) else math.nan


def _line(row: Row) -> bytes:
    return json.dumps(row).encode() + b"\n"
