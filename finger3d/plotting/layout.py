"""A picture of panels in equal cells, and where each of them is in the file: a page lays them out anew.

A panel is narrow enough to be read on a telephone; the picture with all of them is for paper and slides.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from finger3d.io import atomic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Box = tuple[float, float, float, float]
"""Left, top, right and bottom in shares of the picture, from its upper left corner."""

WIDEST = 6.2
"""Widest panel, inches: on 370 pixels, which is what a telephone has, 9 pt are 7.5 pixels high."""

DPI = 120
_KEY = "panels"  # of the text chunk in a PNG file
_TITLE = 0.35  # inches above the cells, if there is a title


@dataclass(frozen=True)
class Sheet:
    """A figure without a display, its axes row by row, and the cell each stands in."""

    figure: Figure
    axes: tuple[Axes, ...]
    cells: tuple[Box, ...]

    def save(self, path: str | Path, names: Sequence[str]) -> None:
        """Write a PNG file that knows its panels by these names, in turn; cells beyond the names are empty."""
        save(self.figure, path, dict(zip(names, self.cells, strict=False)))


@dataclass(frozen=True)
class Panel:
    """A part of a picture: what it shows, and left, top, width and height in pixels."""

    name: str
    left: int
    top: int
    width: int
    height: int


def blank(width: float, height: float) -> Figure:
    """An empty figure, inches. No pyplot: it keeps state, and looks for a display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def sheet(
    rows: int, columns: int, cell: tuple[float, float], margins: tuple[float, float, float, float], title: str = ""
) -> Sheet:
    """Axes in equal cells; matplotlib's own layout engines take as long as the drawing.

    Parameters
    ----------
    cell : width and height, inches
    margins : from a cell's left, right, lower and upper end to its axes, inches
    """
    wide, high = columns * cell[0], rows * cell[1] + (_TITLE if title else 0.0)
    figure = blank(wide, high)
    boxes = cells(rows, columns, 1.0 - rows * cell[1] / high)
    left, right, below, above = margins[0] / wide, margins[1] / wide, margins[2] / high, margins[3] / high
    axes = [
        figure.add_axes((box[0] + left, 1.0 - box[3] + below, box[2] - box[0] - left - right,
                         box[3] - box[1] - below - above))
        for box in boxes
    ]  # fmt: skip
    if title:
        figure.suptitle(title, fontsize=12, y=1.0 - 0.08 / high, va="top")
    return Sheet(figure, tuple(axes), tuple(boxes))


def cells(rows: int, columns: int, top: float = 0.0) -> list[Box]:
    """Equal boxes, row by row, below a strip of this share."""
    high = (1.0 - top) / rows
    return [
        (j / columns, top + i * high, (j + 1) / columns, top + (i + 1) * high)
        for i in range(rows)
        for j in range(columns)
    ]


def save(figure: Figure, path: str | Path, panels: Mapping[str, Box]) -> None:
    """Write a PNG file that knows its panels, by name."""
    known = json.dumps([[name, *(round(share, 6) for share in box)] for name, box in panels.items()])
    with atomic(path) as temporary:
        figure.savefig(
            temporary, format="png", dpi=DPI, metadata={_KEY: known}, pil_kwargs={"compress_level": 4}
        )  # fmt: skip


def panels_of(path: str | Path) -> tuple[tuple[int, int], list[Panel]]:
    """Width and height of a PNG file in pixels, and the panels it knows; none, if it was not made by `save`."""
    from PIL.PngImagePlugin import PngImageFile  # Image.open would load all other formats first

    with PngImageFile(str(path)) as image:
        size = image.size
        # `save` writes it before the pixels; `text` would read these first
        known: list[list[Any]] = json.loads(image.info.get(_KEY, "[]"))
    found = []
    for name, *box in known:
        left, top, right, bottom = (round(share * size[i % 2]) for i, share in enumerate(box))
        found.append(Panel(name, left, top, right - left, bottom - top))
    return size, found
