"""Figures with axes in cells of equal size, drawn without a display."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d.io import atomic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDEST = 6.2
"""Largest width of a cell, in inches."""

DPI = 120
"""Resolution of PNG files, in pixels per inch."""

_TITLE_HEIGHT = 0.35  # inches, above the cells of a figure with a title


@dataclass(frozen=True)
class Sheet:
    """A figure and its axes, in row-major order."""

    figure: Figure
    axes: tuple[Axes, ...]

    def save(self, path: str | Path) -> None:
        """Write the figure as a PNG file."""
        save(self.figure, path)


def blank(width: float, height: float) -> Figure:
    """Return an empty figure of the given size in inches, without pyplot, which would look for a display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def sheet(
    rows: int, columns: int, cell: tuple[float, float], margins: tuple[float, float, float, float], title: str = ""
) -> Sheet:
    """Return a figure with axes in cells of equal size.

    The positions are explicit because the layout engines of matplotlib take as long as the drawing itself.

    Parameters
    ----------
    rows, columns : number of cells
    cell : width and height of a cell, in inches
    margins : distances from the left, right, lower and upper edge of a cell to its axes, in inches
    title : title of the whole figure
    """
    wide, high = columns * cell[0], rows * cell[1] + (_TITLE_HEIGHT if title else 0.0)
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


def style(axes: Axes) -> None:
    """Remove the upper and the right spine, and draw a light grid below the data."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, color="#e4e4e4", lw=0.6)
    axes.set_axisbelow(True)


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure atomically as a PNG file."""
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png", dpi=DPI, pil_kwargs={"compress_level": 4})
