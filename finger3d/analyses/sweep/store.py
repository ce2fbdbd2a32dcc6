"""The results of a sweep in its folder: a journal of finished points, and tables written from it; its progress."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from finger3d import _extras
from finger3d._cost import duration
from finger3d._types import Tree
from finger3d.analyses.sweep.labels import SAMPLE, store_part, write_labels
from finger3d.analyses.sweep.points import BodySpec, Point, Sweep
from finger3d.errors import Finger3dError, MissingError
from finger3d.io import atomic, claimed, write_csv
from finger3d.progress import Progress
from finger3d.results.journal import Journal, Row, journal_rows, number_in, opened
from finger3d.results.summary import PressStep
from finger3d.scene.messages import shown

JOURNAL, TASK = "points.jsonl", "sweep.json"
CSV, PARQUET, GRID = "results.csv", "results.parquet", "marker_grid.csv"
_TEXTS = ("body", "outcome")
_LAST = ("outcome", "residual", "seconds", "build_seconds", "body")

Column = list[int] | list[float] | list[str] | list[bool]


class ResultStore:
    """The rows of a sweep.

    Every finished point is a line of points.jsonl at once.  results.csv and results.parquet are written from these.

    Attributes
    ----------
    rows : of finished points, by number
    lost : rows without numbers, of points whose worker died; they are pressed again when the sweep is continued
    """

    def __init__(self, sweep: Sweep, folder: Path) -> None:
        self.sweep, self.folder = sweep, folder
        self.rows: dict[int, Row] = {}
        self.lost: dict[int, Row] = {}

    @contextmanager
    def open(self) -> Iterator[ResultStore]:
        """Hold the folder, and read the rows of the same sweep.

        Raises
        ------
        Finger3dError
            If another sweep is in the folder, another finger3d is writing there, or its files are damaged.
        MissingError
            If a file cannot be written while it is held; the line says how many points are kept.
        """
        path, task = self.folder / JOURNAL, self.folder / TASK
        with claimed(self.folder, "sweep"), opened(path, task, self.sweep.identity(), _difference) as j:
            self._journal: Journal = j
            self.rows = {row["point"]: row for row in j.rows}
            try:
                yield self
            except (OSError, Finger3dError) as error:
                if not isinstance(error.__cause__ or error, OSError):
                    raise
                raise MissingError(f"{error}; {self.said()}; the same command continues there") from None

    def add(self, row: Row) -> None:
        """Keep the row of a finished point.

        Raises
        ------
        Finger3dError
            If it cannot be written.
        """
        if SAMPLE in row:
            store_part(self.folder, row["point"], row[SAMPLE])
            row = {name: value for name, value in row.items() if name != SAMPLE}
        self._journal.append(row)
        self.rows[row["point"]] = row
        self.lost.pop(row["point"], None)

    def reload(self) -> None:
        """Read the rows from the journal: an interruption may fall between writing a row and its entry in `rows`."""
        self.rows = {row["point"]: row for row, _ in journal_rows(self._journal.path, self._journal.task)}

    def lose(self, point: Point, reason: str) -> None:
        """Note why a point has no numbers."""
        self.lost[point.number] = {"point": point.number, "body": point.body, "outcome": reason}

    def left(self) -> list[Point]:
        """Return the points without a row."""
        return [point for point in self.sweep.points if point.number not in self.rows]

    def write(self) -> None:
        """Write results.csv, the places of a grid of markers, and results.parquet if pyarrow is installed.

        Raises
        ------
        Finger3dError
            If they cannot be written.
        """
        columns = self.columns()
        if not columns["point"]:
            return
        write_csv(self.folder / CSV, columns)
        if grid := [(key, marker) for key, spec in self.sweep.bodies.items() for marker in spec.grid]:
            places = {axis: [getattr(marker, axis) for _, marker in grid] for axis in ("x_mm", "y_mm", "z_mm")}
            names = {"body": [key for key, _ in grid], "marker": [marker.name for _, marker in grid]}
            write_csv(self.folder / GRID, {**names, **places})
        write_labels(self.folder, self.sweep, self.rows, columns)
        if _extras.available("pyarrow"):
            import pyarrow as pa
            import pyarrow.parquet as pq

            with atomic(self.folder / PARQUET) as temporary:
                pq.write_table(pa.table(columns), temporary)

    def columns(self) -> dict[str, Column]:
        """Return the table by column: point, varied keys, numbers of the last step, readings, outcome and times."""
        rows = [row for _, row in sorted((self.rows | self.lost).items())]
        points = [self.sweep.points[row["point"]] for row in rows]
        names = list(dict.fromkeys(name for row in rows for name in row if name not in ("point", *_LAST)))
        names.sort(key=lambda name: name not in PressStep.__dataclass_fields__)  # readings follow the other numbers
        found: dict[str, Column] = {"point": [point.number for point in points]}
        for vary in self.sweep.vary:
            found[vary.key] = _alike([point.values[vary.key] for point in points])
        for name in (*names, *_LAST):
            found[name] = [str(row[name]) for row in rows] if name in _TEXTS else [number_in(row, name) for row in rows]
        return found

    def as_dict(self) -> Tree:
        """Return the folder, the numbers of points and bodies, and the rows of results.csv."""
        columns = self.columns()
        return {
            "results": self.folder,
            "points": len(self.sweep.points),
            "kept": len(self.rows),
            "failed": sum(outcome != "converged" for outcome in columns["outcome"]),
            "bodies": len(self.sweep.bodies),
            "rows": [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)],
        }

    def said(self) -> str:
        """Return how many points are kept, and where."""
        return f"{len(self.rows)} of {len(self.sweep.points)} points are kept in {self.folder}"


def _alike(values: Sequence[object]) -> Column:
    """Return values of one type, as a column needs them: truth values, numbers as float, all else as text."""
    if all(isinstance(v, bool) for v in values):
        return [bool(v) for v in values]
    numbers = [float(v) for v in values if isinstance(v, int | float) and not isinstance(v, bool)]
    if len(numbers) == len(values):
        return numbers
    return [v if isinstance(v, str) else json.dumps(v) for v in values]


def _difference(found: Mapping[str, object], wanted: Mapping[str, object]) -> str:
    """Return in a few words how two sweeps differ."""
    was, now = found.get("vary"), wanted["vary"]
    if not isinstance(was, dict) or not isinstance(now, dict):
        return f"{TASK} is damaged"
    for key in dict.fromkeys([*was, *now]):
        if was.get(key) != now.get(key):
            return f"its {key} is {shown(was[key])}" if key in was else f"it does not vary {key}"
    return "of another scene" if list(was) == list(now) else "its keys are in another order"


DIED = (
    "every worker that was given this body died, perhaps for lack of memory; try a coarser mesh or fewer --workers; "
    "the same command tries it again"
)
"""Why points have no rows whose body has killed its workers."""

_SHOW_S = 0.2
"""Interval of progress reports."""

_BATCH_S = 2.0
"""Time that the points sent to a worker at once should take; so much work is repeated if the worker dies."""


_MOST_SENT = 1000
"""Points that are sent to a worker at once, so that it can tell of all why their body cannot be built."""


@dataclass
class BodyPoints:
    """The points of a body that are not pressed yet, and how many of them the next batch has."""

    spec: BodySpec
    left: list[Point]
    size: int = 1

    @property
    def next(self) -> tuple[Point, ...]:
        """Points that are sent to a worker at once, of which it presses the first `size`."""
        return tuple(self.left[: max(self.size, _MOST_SENT)])

    def advance(self, rows: Sequence[Row]) -> None:
        """Remove the points that have a row now, and let the next batch take `_BATCH_S`."""
        done = {row["point"] for row in rows}
        self.left = [point for point in self.left if point.number not in done]
        seconds = sum(number_in(row, "seconds") for row in rows) / len(rows)
        if seconds > 0.0:  # NaN if a point failed
            self.size = max(1, int(_BATCH_S / seconds))


class SweepProgress:
    """Stores rows, and reports how many points are finished and how long the others will take."""

    def __init__(self, store: ResultStore, report: Progress) -> None:
        self.store, self.report = store, report
        self._before, self._failed = len(store.rows), 0
        self._start = self._shown = time.monotonic()
        report.steps_done, report.steps_total = self._before, len(store.sweep.points)
        if self._before:
            report.say(f"{self._before} of {report.steps_total} points are kept from an earlier run")

    def add(self, row: Row) -> None:
        """Store the row of a finished point."""
        self.store.add(row)
        self._failed += row["outcome"] != "converged"
        done, total, now = len(self.store.rows), self.report.steps_total, time.monotonic()
        self.report.steps_done = done
        if done == total or now - self._shown > _SHOW_S:
            self._shown = now
            left = duration((total - done) * (now - self._start) / (done - self._before))
            self.report.step(
                done, total, f"about {left} left" + f", {self._failed} without numbers" * bool(self._failed)
            )

    def give_up(self, body: BodyPoints, reason: str) -> None:
        """Note and report why the points that are left of a body have no rows; no others are pressed."""
        for point in body.left:
            self.store.lose(point, reason)
        self.report.say(f"{len(body.left)} points lost: {reason}")
        body.left = []
