"""Curves of a page, drawn by plotly in the reader's browser, so that values can be read off and lines hidden."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from finger3d.report.html import asset, embedded


@dataclass(frozen=True)
class Line:
    """A line through points x (n,), y (n,); NaN leaves a gap."""

    label: str
    x: Sequence[float]
    y: Sequence[float]


@dataclass(frozen=True)
class Chart:
    """Lines over one pair of axes.

    Attributes
    ----------
    caption : what it shows
    x, y : titles of the axes, with units
    lines : one at least; their labels are shown where there are several
    legend : what the labels are values of
    more : lines that were left out
    """

    caption: str
    x: str
    y: str
    lines: Sequence[Line]
    legend: str = ""
    more: int = 0

    def html(self) -> str:
        """The box it stands in."""
        text = escape(self.caption, quote=True)
        left_out = f"; {self.more} more lines are left out" if self.more else ""
        return (
            f'<figure class="chart"><div role="img" aria-label="{text}"></div>'
            f"<noscript>Curves need JavaScript; their numbers are in the tables.</noscript>"
            f"<figcaption>{text}{left_out}</figcaption></figure>"
        )


def script(charts: Sequence[Chart]) -> str:
    """The numbers of all charts of a page, and what draws them."""
    data = [
        {
            "caption": chart.caption, "x": chart.x, "y": chart.y, "legend": chart.legend,
            "lines": [{"label": line.label, "x": _known(line.x), "y": _known(line.y)} for line in chart.lines],
        }
        for chart in charts
    ]  # fmt: skip
    numbers = f'<script type="application/json" id="chart-data">{embedded(data)}</script>\n'
    return f"{numbers}<script>{asset('chart.js')}</script>\n"


def _known(values: Sequence[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values]
