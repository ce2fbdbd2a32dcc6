"""design.png: convergence of a design search, and the objective against each free key."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from finger3d.plotting.layout import finish, sheet

_MOST_KEYS = 5  # free keys with a panel
_ROWS = 2  # of panels, at most
_JUDGED, _BEST, _START = "#9db7d5", "#c0392b", "#222222"


def draw(
    path: Path,
    keys: Sequence[str],
    places: Sequence[Sequence[float]],
    values: Sequence[float],
    start: Sequence[float],
    objective: str,
) -> None:
    """Draw the designs with a finite objective and write the picture.

    Parameters
    ----------
    path : PNG file to write
    keys : names of the k free keys
    places : (n, k) values of the free keys of every design, in order of evaluation
    values : (n,) objective of every design; NaN if its solution failed
    start : (k,) values of the free keys of the initial design
    objective : label of the objective
    """
    good = np.isfinite(values)
    at, value = np.array(places, dtype=float)[good], np.array(values, dtype=float)[good]
    best, shown = int(np.argmax(value)), list(keys[:_MOST_KEYS])
    made = sheet(1 + len(shown), math.ceil((1 + len(shown)) / _ROWS), (5.4, 3.9), (0.95, 0.2, 0.6, 0.45))
    first, *others = made.axes
    count = 1 + np.flatnonzero(good)
    first.plot(count, value, "o", ms=3, color=_JUDGED, label="each design")
    first.step(count, np.maximum.accumulate(value), where="post", color=_BEST, lw=1.5, label="best so far")
    first.set_xlabel("designs judged")
    for column, (key, axes) in enumerate(zip(shown, others, strict=False)):
        axes.plot(at[:, column], value, "o", ms=3, color=_JUDGED, label="each design")
        begin = np.flatnonzero(np.all(at == np.array(start), axis=1))[:1]
        axes.plot(at[begin, column], value[begin], "s", ms=6, mfc="none", color=_START, label="start")
        axes.plot(at[best, column], value[best], "*", ms=11, color=_BEST, label="best")
        axes.set_xlabel(key)
    for axes in made.axes:
        finish(axes, y=objective, fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    made.save(path)
