"""sensitivity.png: what changes a number of a press most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from finger3d._types import Tree
from finger3d.plotting.layout import finish, sheet

_MOST_NUMBERS, _MOST_KEYS = 6, 10
"""Largest numbers of panels, and of bars in each."""

_LEAST = 1e-3
"""Effect, over the largest, below which a key is left out."""

_RISES, _FALLS = "#2b6ca3", "#c0392b"


def draw(path: Path, title: str, numbers: Mapping[str, float], table: Sequence[Tree]) -> None:
    """Draw, for each number, its change with each key; rows of the table name number, key, change and effect."""
    names = list(numbers)[:_MOST_NUMBERS]
    count = min(sum(row["number"] == names[0] for row in table), _MOST_KEYS)
    made = sheet(len(names), min(len(names), 2), (6.4, 1.0 + 0.3 * count), (2.4, 0.3, 0.6, 0.3), title)
    for name, axes in zip(names, made.axes, strict=False):
        rows = [row for row in table if row["number"] == name][:count]
        shown = [row for row in rows if abs(row["effect"]) >= _LEAST * abs(rows[0]["effect"])]
        values = [row["effect"] for row in shown]
        colours = [_RISES if value >= 0.0 else _FALLS for value in values]
        axes.barh(range(len(shown)), values, color=colours)
        axes.set_yticks(range(len(shown)), [f"{row['key']} + {row['change']:.3g}" for row in shown], fontsize=8)
        axes.invert_yaxis()
        axes.locator_params(axis="x", nbins=5)
        axes.axvline(0.0, color="0.3", lw=0.8)
        finish(axes, x=f"change of {name} = {numbers[name]:.4g}")
    made.save(path)
