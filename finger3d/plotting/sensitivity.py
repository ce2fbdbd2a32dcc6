"""sensitivity.png: what changes a number of a press most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from finger3d._types import Tree
from finger3d.plotting.layout import finish, sheet

_MOST_NUMBERS, _MOST_KEYS = 6, 10
"""Largest numbers of panels, and of bars in each."""

_LEAST = 1e-3
"""Effect, over the largest, below which a key is left out."""

_GROWS, _FALLS = "#2b6ca3", "#c0392b"


def draw(path: Path, title: str, numbers: Mapping[str, float], table: Sequence[Tree]) -> None:
    """Draw, for each number, its changes as each key falls and grows, with their errors.

    Rows of the table name number, key, change and both effects, the largest first.
    """
    names = list(numbers)[:_MOST_NUMBERS]
    count = min(sum(row["number"] == names[0] for row in table), _MOST_KEYS)
    made = sheet(len(names), min(len(names), 2), (6.4, 1.2 + 0.36 * count), (2.4, 0.3, 0.6, 0.3), title)
    for name, axes in zip(names, made.axes, strict=False):
        rows = [row for row in table if row["number"] == name][:count]
        largest = max(_size(row) for row in rows)
        shown = [row for row in rows if _size(row) > _LEAST * largest]
        for way, sign, offset, colour in (("falling", "less", -0.2, _FALLS), ("growing", "plus", 0.2, _GROWS)):
            errors = np.nan_to_num([row[f"{way}_error"] for row in shown])
            places = np.arange(len(shown)) + offset
            values = np.nan_to_num([row[way] for row in shown])
            axes.barh(places, values, 0.36, xerr=errors, color=colour, label=f"key {sign} its change",
                      error_kw={"lw": 0.8, "ecolor": "0.2"})  # fmt: skip
        axes.set_yticks(range(len(shown)), [f"{row['key']} by {row['change']:.3g}" for row in shown], fontsize=8)
        axes.invert_yaxis()
        axes.locator_params(axis="x", nbins=5)
        axes.axvline(0.0, color="0.3", lw=0.8)
        axes.legend(fontsize=7)
        finish(axes, x=f"change of {name} = {numbers[name]:.4g}")
    made.save(path)


def _size(row: Tree) -> float:
    return float(np.nanmax(np.abs([row["falling"], row["growing"]])))
