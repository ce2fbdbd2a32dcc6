"""Interactive charts of a page, drawn in the browser by plotly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from finger3d.report.html import asset, embedded


@dataclass(frozen=True)
class Line:
    """Line through points with coordinates x and y, shape (n,); NaN leaves a gap."""

    label: str
    x: Sequence[float]
    y: Sequence[float]


@dataclass(frozen=True)
class Chart:
    """Chart of lines in common axes.

    Attributes
    ----------
    caption : caption of the chart
    x, y : titles of the axes, with units
    lines : at least one line; labels are shown if there are several
    legend : title of the legend: the quantity whose values the labels are
    more : number of omitted lines
    joined : whether the points of a line are joined
    """

    caption: str
    x: str
    y: str
    lines: Sequence[Line]
    legend: str = ""
    more: int = 0
    joined: bool = True

    def html(self) -> str:
        """Return the HTML element that holds the chart."""
        text = escape(self.caption, quote=True)
        left_out = f"; {self.more} more lines are left out" if self.more else ""
        return (
            f'<figure class="chart"><div role="img" aria-label="{text}"></div>'
            f"<noscript>Curves need JavaScript; their numbers are in the tables.</noscript>"
            f"<figcaption>{text}{left_out}</figcaption></figure>"
        )


def script(charts: Sequence[Chart]) -> str:
    """Return the scripts with the data of all charts of a page and the code that draws them."""
    data = [
        {
            "caption": chart.caption,
            "x": chart.x,
            "y": chart.y,
            "legend": chart.legend,
            "joined": chart.joined,
            "lines": [{"label": line.label, "x": _known(line.x), "y": _known(line.y)} for line in chart.lines],
        }
        for chart in charts
    ]
    numbers = f'<script type="application/json" id="chart-data">{embedded(data)}</script>\n'
    return f"{numbers}<script>{asset('chart.js')}</script>\n"


def _known(values: Sequence[float]) -> list[float | None]:
    """Replace NaN and infinity, which JSON lacks, by None."""
    return [value if math.isfinite(value) else None for value in values]
