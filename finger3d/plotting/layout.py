"""Figures with axes in cells of equal size, drawn without a display."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
    count: int, columns: int, cell: tuple[float, float], margins: tuple[float, float, float, float], title: str = ""
) -> Sheet:
    """Return a figure with axes in cells of equal size.

    The positions are explicit because the layout engines of matplotlib take as long as the drawing itself.

    Parameters
    ----------
    count, columns : number of cells, and of those beside each other
    cell : width and height of a cell, in inches
    margins : distances from the left, right, lower and upper edge of a cell to its axes, in inches
    title : title of the whole figure
    """
    rows = math.ceil(count / columns)
    wide, high = columns * cell[0], rows * cell[1] + (_TITLE_HEIGHT if title else 0.0)
    figure = blank(wide, high)
    left, right, below, above = margins
    size, axes = ((cell[0] - left - right) / wide, (cell[1] - below - above) / high), []
    for row, column in (divmod(number, columns) for number in range(count)):
        corner = (column * cell[0] + left) / wide, ((rows - 1 - row) * cell[1] + below) / high
        axes.append(figure.add_axes((*corner, *size)))
    head(figure, title)
    return Sheet(figure, tuple(axes))


def head(figure: Figure, title: str, size: float = 12.0, above: float = 0.08) -> None:
    """Write the title of a figure, if it has one, `above` inches below its upper edge."""
    if title:
        figure.suptitle(title, fontsize=size, y=1.0 - above / figure.get_figheight(), va="top")


def finish(axes: Axes, x: str = "", y: str = "", **legend: Any) -> None:
    """Name the axes, draw a light grid below the data, and a legend without a frame if its options are given."""
    if x:
        axes.set_xlabel(x)
    if y:
        axes.set_ylabel(y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, color="#e4e4e4", lw=0.6)
    axes.set_axisbelow(True)
    if legend:
        axes.legend(frameon=False, **legend)


def save(figure: Figure, path: str | Path, dpi: int = DPI) -> None:
    """Write a figure atomically as a PNG file."""
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png", dpi=dpi, pil_kwargs={"compress_level": 4})
