"""sweep.png: what changes with what was varied, a panel for each key that has several numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from finger3d.panels import sheet

_MOST_LINES = 8
_MOST_PANELS = 3
_LINE = 0.21  # inches of a line of the legend,
_WIDE = 64  # and letters that fit into it


def draw(path: Path, columns: Mapping[str, Sequence[Any]], keys: Sequence[str]) -> bool:
    """Draw the normal force (and the first gauge's strain) against each varied number; a line for each other setting.

    Returns
    -------
    bool
        Whether there was anything to draw.
    """
    good = np.array([outcome == "converged" for outcome in columns["outcome"]], dtype=bool)
    along = [k for k in keys if len(set(columns[k])) > 1 and not isinstance(columns[k][0], str)][:_MOST_PANELS]
    if not along or not good.any():
        return False
    told = ["normal_force_N", *[name for name in columns if name.startswith("gauge_")][:1]]
    lines = {key: _lines(columns, good, [k for k in keys if k != key]) for key in along}
    high = max(1 + math.ceil(min(len(labels), _MOST_LINES + 1) / _abreast(labels)) for labels in lines.values())
    below = 0.65 + _LINE * high * (len(keys) > 1)
    made = sheet(len(told), len(along), (5.6, 3.5 + below), (0.9, 0.15, below, 0.2))
    for axes, (name, key) in zip(made.axes, product(told, along), strict=True):
        _panel(axes, columns, lines[key], key, [k for k in keys if k != key], name)
    made.save(path, [f"{_called(name)} against {key}" for name, key in product(told, along)])
    return True


def _lines(columns: Mapping[str, Sequence[Any]], good: Any, others: Sequence[str]) -> dict[str, list[int]]:
    """Numbers of the good rows by their setting of the other keys, as it is written in the legend."""
    found: dict[str, list[int]] = {}
    for i in np.flatnonzero(good).tolist():
        values = [columns[k][i] for k in others]
        setting = ", ".join(f"{v:.12g}" if isinstance(v, float) else str(v) for v in values)
        found.setdefault(setting, []).append(i)
    return found


def _abreast(labels: Iterable[str]) -> int:
    """How many labels have room beside each other in a panel."""
    return max(1, min(4, _WIDE // (6 + max(map(len, labels)))))


def _panel(
    axes: Any,
    columns: Mapping[str, Sequence[Any]],
    lines: Mapping[str, Sequence[int]],
    key: str,
    others: Sequence[str],
    name: str,
) -> None:
    for label, rows in list(lines.items())[:_MOST_LINES]:
        on = sorted(rows, key=lambda i: columns[key][i])
        x, y = (np.array([columns[k][i] for i in on], dtype=float) for k in (key, name))
        axes.plot(x, y, "o-", ms=4, lw=1.2, label=label)
    if len(lines) > _MOST_LINES:
        axes.plot([], [], " ", label=f"and {len(lines) - _MOST_LINES} more")
    axes.set_xlabel(key)
    axes.set_ylabel("normal force (N)" if name == "normal_force_N" else f"strain, {name.removeprefix('gauge_')}")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, color="#e4e4e4", lw=0.6)
    if others:
        axes.legend(
            title=", ".join(others), frameon=False, fontsize=9, title_fontsize=9, loc="upper center",
            bbox_to_anchor=(0.45, -0.13), ncols=_abreast(lines),
        )  # fmt: skip


def _called(name: str) -> str:
    return "Normal force" if name == "normal_force_N" else f"Strain, {name.removeprefix('gauge_')}"
