"""Progress of a sweep: the points that are left of each body, and what is reported of the finished ones."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

from finger3d.analyses.sweep.points import BodySpec, Point
from finger3d.analyses.sweep.store import ResultStore
from finger3d.progress import Progress
from finger3d.results.journal import Row, number_in

_SHOW_S = 0.2
"""Interval of progress reports."""

_BATCH_S = 2.0
"""Time that the points sent to a worker at once should take; so much work is repeated if the worker dies."""


@dataclass
class BodyPoints:
    """The points of a body that are not pressed yet, and how many of them the next batch has."""

    spec: BodySpec
    left: list[Point]
    size: int = 1

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
        """Note and report why the points that are left of a body have no rows."""
        for point in body.left:
            self.store.lose(point, reason)
        self.report.say(f"{len(body.left)} points lost: {reason}")


def duration(seconds: float) -> str:
    """Return a short text such as "12 s", "3 min" or "1.5 h"."""
    if seconds < 90.0:
        return f"{math.ceil(seconds)} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
