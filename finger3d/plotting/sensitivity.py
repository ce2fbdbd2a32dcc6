"""sensitivity.png: what changes a number of a press most."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from finger3d.plotting.layout import finish, sheet

if TYPE_CHECKING:
    from finger3d.analyses.sensitivity import Sensitivity

_MOST_NUMBERS, _MOST_KEYS = 6, 10
"""Largest numbers of panels, and of bars in each."""

_LEAST = 1e-3
"""Effect, over the largest, below which a key is left out."""

_RISES, _FALLS = "#2b6ca3", "#c0392b"


def draw(path: Path, found: Sensitivity) -> None:
    """Draw, for each number, its change with each key changed by its tolerance, or by 1 % without one."""
    names = list(found.derivatives)[:_MOST_NUMBERS]
    columns = min(len(names), 2)
    count = min(len(found.keys), _MOST_KEYS)
    made = sheet(len(names), columns, (6.4, 1.0 + 0.3 * count), (2.4, 0.3, 0.6, 0.3), found.title)
    for name, axes in zip(names, made.axes, strict=False):
        rows = [row for row in found.rows() if row["number"] == name][:count]
        shown = [row for row in rows if abs(row["effect"]) >= _LEAST * abs(rows[0]["effect"])]
        values = [row["effect"] for row in shown]
        colours = [_RISES if value >= 0.0 else _FALLS for value in values]
        axes.barh(range(len(shown)), values, color=colours)
        axes.set_yticks(range(len(shown)), [f"{row['key']} + {row['change']:.3g}" for row in shown], fontsize=8)
        axes.invert_yaxis()
        axes.locator_params(axis="x", nbins=5)
        axes.axvline(0.0, color="0.3", lw=0.8)
        finish(axes, x=f"change of {name} = {found.numbers[name]:.4g}")
    made.save(path)
