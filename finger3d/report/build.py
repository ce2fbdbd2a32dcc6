"""Self-contained HTML page with rows, tables, text, pictures, charts and a 3D view. All text is escaped."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._machine import versions as installed
from finger3d.accuracy.error_bars import with_error
from finger3d.io import atomic
from finger3d.report.html import asset

if TYPE_CHECKING:
    from finger3d.report.chart import Chart
    from finger3d.report.view3d import View3D

# Content security policy: only scripts, styles and pictures inside the page; no network access.
_POLICY = "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"

# Collapsed sections are expanded for printing.
_UNFOLD = (
    'addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => { d.open = true; }));'
)

CITE = (
    "The finger3d authors. finger3d: frictional contact of an elastic finger-shaped tactile sensor in three dimensions"
)

PAPER = (
    "Takashi Maeno, Tomoyuki Kawamura, Sen-Chieh Cheng. Friction Estimation by Pressing an Elastic Finger-Shaped "
    "Sensor Against a Surface. IEEE Transactions on Robotics and Automation 20(2), 2004"
)
"""Citations of the program and of the paper that it follows, as in CITATION.cff."""

_MOST_UNBROKEN = 18  # characters of a table cell that is not broken into lines


@dataclass(frozen=True)
class HeadlineRow:
    """Main result of a page: its name, its value (a number or text), its unit, and its error in that unit or None."""

    name: str
    value: float | str
    unit: str = ""
    error: float | None = None

    @property
    def text(self) -> str:
        """Value, error and unit, as a terminal shows them."""
        return f"{number(self.value, self.error)} {self.unit}".rstrip().replace("±", "+-").replace("²", "2")


@dataclass(frozen=True)
class Table:
    """Table; numbers have five significant digits and are aligned to the right."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]


@dataclass(frozen=True)
class Figure:
    """PNG file, relative to the folder of the page; omitted if it does not exist."""

    path: str | Path
    caption: str = ""


@dataclass(frozen=True)
class Code:
    """Preformatted text; with a `summary`, collapsed below it."""

    text: str
    summary: str = ""


Part = str | Table | Figure | Code


@dataclass(frozen=True)
class PageSection:
    """Heading followed by paragraphs, tables, pictures and code; collapsed if `folded`."""

    title: str
    parts: Sequence[Part]
    folded: bool = False


@dataclass(frozen=True)
class Page:
    """Page of a result; versions and citations follow the sections.

    Attributes
    ----------
    title : title of the page
    headline : main results
    sections : sections of the page, in order
    figures : pictures below the headline
    view : interactive 3D view
    charts : interactive charts
    command : command that made the results, for instance ``press``
    outcome : outcome of the command, in one line
    good : whether the command succeeded
    notes : warnings and advice, shown below the headline
    versions : package -> version used for the results; default: the installed versions
    """

    title: str
    headline: Sequence[HeadlineRow] = ()
    sections: Sequence[PageSection] = ()
    figures: Sequence[Figure] = ()
    view: View3D | None = None
    charts: Sequence[Chart] = ()
    command: str = ""
    outcome: str = "converged"
    good: bool = True
    notes: Sequence[str] = ()
    versions: Mapping[str, str] | None = None

    def write(self, folder: str | Path, file: str = "report.html") -> Path:
        """Write the page atomically into the folder that has its figures, and return its path.

        Raises
        ------
        Finger3dError
            If the page cannot be written.
        """
        target = Path(folder) / file
        before, after = _document(self.title, self._body(target.parent))
        scripts = [self.view.script()] if self.view is not None else []
        if self.charts:
            from finger3d.report.chart import script

            scripts.append(script(self.charts))
        with atomic(target) as temporary, temporary.open("wb") as stream:
            stream.write(before.encode())
            if scripts:
                # "</script" would end the element
                plotly = asset("plotly/plotly-gl3d.min.js").encode().replace(b"</script", b"<\\/script")
                stream.write(b"<script>" + plotly + b"</script>\n")
            stream.write("".join([*scripts, after]).encode())
        return target

    def _body(self, folder: Path) -> str:
        """Return the HTML of all that is seen."""
        body = [
            f'<header><p class="kicker">finger3d {escape(self.command)}</p><h1>{escape(self.title)}</h1>'
            f'<p class="{"good" if self.good else "bad"}">{escape(self.outcome)}</p></header>'
        ]
        if self.headline:
            body.append(f'<dl class="headline">{"".join(map(_card, self.headline))}</dl>')
        if self.notes:
            body.append(f'<ul class="notes">{"".join(f"<li>{escape(note)}</li>" for note in self.notes)}</ul>')
        if self.view is not None:
            body.append(self.view.html())
        body += [_figures(folder, self.figures), _grid(chart.html() for chart in self.charts)]
        found = installed() if self.versions is None else self.versions
        closing = [
            PageSection("Versions", [", ".join(f"{k} {v}" for k, v in found.items())]),
            PageSection("How to cite", [f"{CITE}, version {found.get('finger3d', 'unknown')}.", f"{PAPER}."]),
        ]
        return "\n".join([*body, *(_section(folder, section) for section in (*self.sections, *closing))])


def number(value: object, error: float | None = None) -> str:
    """Return a number with its error, or with five significant digits; other values as text."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return with_error(value, error)


def _card(row: HeadlineRow) -> str:
    unit = f' <span class="unit">{escape(row.unit)}</span>' if row.unit else ""
    return f"<div><dt>{escape(row.name)}</dt><dd>{escape(number(row.value, row.error))}{unit}</dd></div>"


def _section(folder: Path, section: PageSection) -> str:
    inside = "".join(_part(folder, part) for part in section.parts)
    title = f"<h2>{escape(section.title)}</h2>"
    if section.folded:
        return f"<section><details><summary>{title}</summary>{inside}</details></section>"
    return f"<section>{title}{inside}</section>"


def _part(folder: Path, part: Part) -> str:
    if isinstance(part, Table):
        return _table(part)
    if isinstance(part, Figure):
        return _figures(folder, [part])
    if isinstance(part, Code):
        code = f"<pre>{escape(part.text)}</pre>"
        return f"<details><summary>{escape(part.summary)}</summary>{code}</details>" if part.summary else code
    return f"<p>{escape(part)}</p>"


def _table(table: Table) -> str:
    # Column names may break after an underscore.
    head = "".join(f'<th scope="col">{escape(name).replace("_", "_<wbr>")}</th>' for name in table.head)
    rows = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table.rows)
    # A wide table scrolls in its own box, which has a tab index for keyboard users.
    return f'<div class="wide" tabindex="0"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _cell(value: object) -> str:
    text = number(value)
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    kind = "number" if numeric else "short" if len(text) <= _MOST_UNBROKEN else ""
    return f'<td class="{kind}">{escape(text)}</td>' if kind else f"<td>{escape(text)}</td>"


def _figures(folder: Path, figures: Sequence[Figure]) -> str:
    """Return existing pictures in a grid."""
    return _grid(_figure(folder / figure.path, figure.caption) for figure in figures)


def _grid(figures: Iterable[str]) -> str:
    shown = "".join(figures)
    return f'<div class="figures">{shown}</div>' if shown else ""


def _figure(path: Path, caption: str) -> str:
    """Return a figure element with the embedded picture, which scrolls in its own box on a narrow screen."""
    if not path.exists():
        return ""
    data, text = base64.b64encode(path.read_bytes()).decode("ascii"), escape(caption, quote=True)
    image = f'<img alt="{text}" src="data:image/png;base64,{data}">'
    return (
        f'<figure class="picture"><div class="wide" tabindex="0">{image}</div><figcaption>{text}</figcaption></figure>'
    )


def _document(title: str, body: str) -> tuple[str, str]:
    """Return the HTML before and after the scripts of view and charts."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)} - finger3d</title>\n<style>\n{asset('style.css')}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n<script>{_UNFOLD}</script>\n"
    ), "</body>\n</html>\n"
