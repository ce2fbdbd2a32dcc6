"""What a sweep keeps: a line for every finished point at once, and tables of all of them for others to read."""

from __future__ import annotations

import errno
import json
import math
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import Any

from finger3d.analyses.sweep.points import Sweep
from finger3d.errors import Finger3dError, MissingError
from finger3d.io import atomic, claimed, write_csv, write_json
from finger3d.scene.messages import shown

JOURNAL, IDENTITY = "points.jsonl", "sweep.json"
_LAST = ("outcome", "residual", "seconds", "build_seconds", "body")
_EVERY_S, _SHARE = 1.0, 0.05

Row = dict[str, Any]


class ResultStore:
    """The rows of a sweep in its folder.

    Every finished point is one appended line of points.jsonl, so that whatever ends the program loses none; a line cut
    short by that is left out.  results.parquet and results.csv are written from them, whole or not at all.
    """

    def __init__(self, sweep: Sweep, folder: Path) -> None:
        self.sweep, self.folder = sweep, folder
        self.rows: dict[int, Row] = {}
        self.lost: dict[int, Row] = {}
        self._written, self._cost = math.inf, 0.0

    @contextmanager
    def open(self) -> Iterator[ResultStore]:
        """Take the folder: go on where the same sweep ended; another sweep, or a running one, is refused."""
        with claimed(self.folder, "sweep"):
            self._begin()
            try:
                # unbuffered: what does not fit is told at once, and not again when the file is closed
                self._stream = (self.folder / JOURNAL).open("ab", buffering=0)
            except OSError as error:
                raise self._full(JOURNAL, error) from None
            try:
                yield self
            finally:
                self._stream.close()

    def _begin(self) -> None:
        wanted = self._identity()
        path = self.folder / IDENTITY
        if path.exists():
            found = _identity_in(path)
            if found != wanted:
                raise Finger3dError(
                    f"--out {self.folder}: holds another sweep ({_difference(found, wanted)}); name another folder"
                )
            self.rows = dict(self._journal())
        elif (self.folder / JOURNAL).exists():
            raise Finger3dError(f"--out {self.folder}: holds {JOURNAL} without {IDENTITY}; name another folder")
        text = "".join(_line(row) for row in self.rows.values())
        with self.room(JOURNAL), atomic(self.folder / JOURNAL) as temporary:
            temporary.write_text(text, encoding="utf-8")
        with self.room(IDENTITY):
            write_json(path, wanted)

    def _journal(self) -> Iterator[tuple[int, Row]]:
        """Number and row of every finished point; a line that was cut short is no row.

        Raises
        ------
        Finger3dError
            If the file cannot be read, or a line is no row of this sweep.
        """
        path = self.folder / JOURNAL
        if not path.exists():
            return
        try:
            lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
        except OSError as error:
            raise Finger3dError(f"{path}: cannot be read: {error.strerror}; name another folder") from None
        for number, line in enumerate(lines, start=1):
            try:
                row = json.loads(line)
            except ValueError:
                continue
            except RecursionError:
                row = None
            if mistake := self._mistake(row):
                raise Finger3dError(
                    f"{path}: line {number}: {mistake}; remove the line, and the same command presses its point again"
                )
            yield row["point"], row

    def _mistake(self, row: Any) -> str:
        """What a row of the journal has that a sweep does not write, or nothing."""
        if not isinstance(row, dict):
            return "is no JSON object"
        point = row.get("point")
        if not isinstance(point, int) or isinstance(point, bool) or not 0 <= point < len(self.sweep.points):
            return f"point must be a number from 0 to {len(self.sweep.points) - 1}"
        if row.get("body") != self.sweep.points[point].body:
            return f"body is not that of point {point}"
        if not isinstance(row.get("outcome"), str):
            return "outcome must be text"
        for name, value in row.items():
            if name not in ("point", "body", "outcome") and value is not None and not _is_number(value):
                return f"{shown(name)} must be a number"
        force = row.get("normal_force_N")
        if row["outcome"] == "converged" and (force is None or not math.isfinite(force)):
            return "normal_force_N must be a finite number"
        taken = [v.key for v in self.sweep.vary if v.key in row]
        return f"{taken[0]} is given by the sweep" if taken else ""

    def _identity(self) -> dict[str, Any]:
        return json.loads(json.dumps({"finger3d": metadata.version("finger3d")} | self.sweep.identity()))

    def add(self, row: Row) -> bool:
        """Keep a finished point; return whether it is new."""
        if row["point"] in self.rows:
            return False
        try:
            line = _line(row).encode()
            if self._stream.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise self._full(JOURNAL, error) from None
        self.rows[row["point"]] = row
        self.lost.pop(row["point"], None)
        return True

    def lose(self, number: int, reason: str) -> None:
        """Note why a point has no numbers; it is tried again when the sweep goes on."""
        if number not in self.rows:
            self.lost[number] = {"point": number, "body": self.sweep.points[number].body, "outcome": reason}

    def left(self) -> list[int]:
        """Numbers of the points that are not kept."""
        return [p.number for p in self.sweep.points if p.number not in self.rows]

    def refresh(self) -> None:
        """Write the tables, unless that was done just now; a second after the first row for the first time.

        What writes them takes as long to load as many presses: a short sweep needs it once, at its end.
        """
        now = time.monotonic()
        self._written = min(self._written, now)
        if now - self._written > max(_EVERY_S, self._cost / _SHARE):
            self.write()

    def write(self) -> None:
        """Write results.parquet and results.csv."""
        from finger3d.analyses.sweep.table import write_parquet

        start = time.monotonic()
        columns = self.columns()
        if columns["point"]:
            with self.room("results.parquet"):
                with atomic(self.folder / "results.parquet") as temporary:
                    write_parquet(temporary, columns)
                write_csv(self.folder / "results.csv", columns)
        self._written = time.monotonic()
        self._cost = self._written - start

    def columns(self) -> dict[str, list[Any]]:
        """Name -> values: point number, varied keys, the contract's numbers, gauges, and how it went."""
        rows = sorted((self.rows | self.lost).values(), key=lambda row: row["point"])
        keys = [v.key for v in self.sweep.vary]
        names = list(dict.fromkeys(name for row in rows for name in row if name not in ("point", *_LAST)))
        names.sort(key=lambda name: name.startswith("gauge_"))
        found: dict[str, list[Any]] = {"point": [row["point"] for row in rows]}
        for key in keys:
            found[key] = _alike([self.sweep.points[row["point"]].values[key] for row in rows])
        for name in (*names, "outcome", "residual", "seconds", "build_seconds", "body"):
            text = name in ("outcome", "body")
            found[name] = [row[name] if text else _number(row.get(name)) for row in rows]
        return found

    def said(self) -> str:
        """How many points are kept, and where."""
        return f"{len(self.rows)} of {len(self.sweep.points)} points are kept in {self.folder}"

    @contextmanager
    def room(self, name: str) -> Iterator[None]:
        """Write a file of this name within; what hinders it is told with how much is kept."""
        try:
            yield
        except Finger3dError as error:
            raise self._full(name, error.__cause__ or error) from None

    def _full(self, name: str, error: BaseException) -> MissingError:
        reason = getattr(error, "strerror", None) or str(error)
        return MissingError(
            f"cannot write {self.folder / name}: {reason}; {self.said()}; mend that, and the same command goes on"
        )


def _line(row: Mapping[str, Any]) -> str:
    return json.dumps(row) + "\n"


def _is_number(value: Any) -> bool:
    """Whether a value is a number that fits into a double."""
    return isinstance(value, float) or (isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63)


def _identity_in(path: Path) -> dict[str, Any]:
    """Read sweep.json.

    Raises
    ------
    Finger3dError
        If it is not as a sweep writes it.
    """
    try:
        found: Any = json.loads(path.read_text(encoding="utf-8"))
        vary = found["vary"]
        if not isinstance(vary, dict) or not all(isinstance(t, str) for texts in vary.values() for t in texts):
            raise TypeError(vary)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        raise Finger3dError(
            f"{path}: cannot be read, or is not as a sweep wrote it; restore it, or name another folder with --out"
        ) from None
    checked: dict[str, Any] = found
    return checked


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _alike(values: list[Any]) -> list[Any]:
    """Values of one type, as a column asks for: numbers as float, truth as it is, all else as text."""
    if all(isinstance(v, bool) for v in values):
        return values
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return [float(v) for v in values]
    return [v if isinstance(v, str) else json.dumps(v) for v in values]


def _difference(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """What tells two sweeps apart, in a few words."""
    if found.get("finger3d") != wanted["finger3d"]:
        return f"made by finger3d {found.get('finger3d', 'of another kind')}"
    for key in dict.fromkeys([*found.get("vary", {}), *wanted["vary"]]):
        was, now = found.get("vary", {}).get(key), wanted["vary"].get(key)
        if was != now:
            return f"its {key} is {','.join(was)}" if was else f"it does not vary {key}"
    if list(found.get("vary", {})) != list(wanted["vary"]):
        return "its keys are in another order"
    return "of another scene"
