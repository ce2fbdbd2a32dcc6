"""Figures of axes in equal cells, without a display."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d.io import atomic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDEST = 6.2
"""Largest width of a cell, inches."""

DPI = 120
_TITLE = 0.35  # inches above the cells, if there is a title


@dataclass(frozen=True)
class Sheet:
    """A figure without a display, and its axes row by row."""

    figure: Figure
    axes: tuple[Axes, ...]

    def save(self, path: str | Path) -> None:
        """Write the figure as a PNG file."""
        save(self.figure, path)


def blank(width: float, height: float) -> Figure:
    """Return an empty figure of a width and a height in inches, without pyplot, which looks for a display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def sheet(
    rows: int, columns: int, cell: tuple[float, float], margins: tuple[float, float, float, float], title: str = ""
) -> Sheet:
    """Return axes in equal cells; the layout engines of matplotlib take as long as the drawing.

    Parameters
    ----------
    cell : width and height, inches
    margins : from a cell's left, right, lower and upper end to its axes, inches
    """
    wide, high = columns * cell[0], rows * cell[1] + (_TITLE if title else 0.0)
    figure = blank(wide, high)
    left, right, below, above = margins
    axes = [
        figure.add_axes(
            (
                (column * cell[0] + left) / wide,
                ((rows - 1 - row) * cell[1] + below) / high,
                (cell[0] - left - right) / wide,
                (cell[1] - below - above) / high,
            )
        )
        for row in range(rows)
        for column in range(columns)
    ]
    if title:
        figure.suptitle(title, fontsize=12, y=1.0 - 0.08 / high, va="top")
    return Sheet(figure, tuple(axes))


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure as a PNG file, whole or not at all."""
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png", dpi=DPI, pil_kwargs={"compress_level": 4})
