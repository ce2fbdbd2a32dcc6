"""A self-contained HTML page from rows, tables, text and pictures; all text is escaped."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._machine import versions as installed
from finger3d.io import atomic
from finger3d.report.html import asset
from finger3d.results.format import with_error

if TYPE_CHECKING:
    from finger3d.report.chart import Chart
    from finger3d.report.view3d import View3D

# The page may run its own script and show its own pictures, and may not ask any machine for anything.
_POLICY = "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"

# What is folded away on a screen is printed all the same.
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
"""How to cite the program and the paper it grew from, as in CITATION.cff."""

_SHORT = 18  # letters of a cell that is not broken into lines


@dataclass(frozen=True)
class HeadlineRow:
    """A number (or text) of the headline: what it is, its unit, and its error in the same unit, if one is known."""

    name: str
    value: float | str
    unit: str = ""
    error: float | None = None


@dataclass(frozen=True)
class Table:
    """A table; a cell that is a number is written with five digits and set flush right."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]


@dataclass(frozen=True)
class Figure:
    """A PNG file in the page's folder unless its path says otherwise; a file that does not exist is left out."""

    path: str | Path
    caption: str = ""


@dataclass(frozen=True)
class Code:
    """Text to be shown as it is; with a `summary` it is folded away behind that."""

    text: str
    summary: str = ""


Part = str | Table | Figure | Code


@dataclass(frozen=True)
class PageSection:
    """A heading and what stands under it: paragraphs, tables, pictures, code; `folded` hides it behind the heading."""

    title: str
    parts: Sequence[Part]
    folded: bool = False


def write_page(
    folder: str | Path,
    title: str,
    headline: Sequence[HeadlineRow] = (),
    sections: Sequence[PageSection] = (),
    figures: Sequence[Figure] = (),
    view: View3D | None = None,
    charts: Sequence[Chart] = (),
    *,
    command: str = "",
    outcome: str = "converged",
    good: bool = True,
    notes: Sequence[str] = (),
    versions: Mapping[str, str] | None = None,
    file: str = "report.html",
) -> Path:
    """Write a page into a folder, whole or not at all; versions and how to cite are added below the sections.

    Parameters
    ----------
    folder : where the page goes, and where figures without a folder are
    headline : the numbers a reader came for
    view : a body to turn, in 3D
    charts : curves to read values off
    command : what made the results, for instance ``press``
    outcome, good : one line on how it went, and whether that is well
    notes : warnings and advice, shown under the headline
    versions : name -> version of what made the numbers; default: what is installed

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    Finger3dError
        If it cannot be written.
    """
    folder = Path(folder)
    body = [
        f'<header><p class="kicker">finger3d {escape(command)}</p><h1>{escape(title)}</h1>'
        f'<p class="{"good" if good else "bad"}">{escape(outcome)}</p></header>'
    ]
    if headline:
        body.append(f'<dl class="headline">{"".join(map(_card, headline))}</dl>')
    if notes:
        body.append(f'<ul class="notes">{"".join(f"<li>{escape(note)}</li>" for note in notes)}</ul>')
    if view is not None:
        body.append(view.html())
    body += [_figures(folder, figures), _grid(chart.html() for chart in charts)]
    found = installed() if versions is None else versions
    closing = [
        PageSection("Versions", [", ".join(f"{k} {v}" for k, v in found.items())]),
        PageSection("How to cite", [f"{CITE}, version {found.get('finger3d', 'unknown')}.", f"{PAPER}."]),
    ]
    body += [_section(folder, s) for s in (*sections, *closing)]
    scripts = [view.script()] if view is not None else []
    if charts:
        from finger3d.report.chart import script

        scripts.append(script(charts))
    before, after = _document(title, "\n".join(body))
    target = folder / file
    with atomic(target) as temporary, temporary.open("wb") as stream:
        stream.write(before.encode())
        if scripts:
            stream.write(b"<script>" + _plotly() + b"</script>\n")
        stream.write("".join([*scripts, after]).encode())
    return target


def number(value: object, error: float | None = None) -> str:
    """Return a number with its error, or with five digits; text as it is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return with_error(value, error)


def _plotly() -> bytes:
    """Return the text of plotly.js, which comes with plotly; no "</script" in it, which would end the element."""
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs()).encode().replace(b"</script", b"<\\/script")


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
    # Names of columns are long and of one word: they may break where an underscore is.
    head = "".join(f'<th scope="col">{escape(name).replace("_", "_<wbr>")}</th>' for name in table.head)
    rows = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table.rows)
    # A wide table scrolls in its own box, which the keyboard can reach too.
    return f'<div class="wide" tabindex="0"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _cell(value: object) -> str:
    text = number(value)
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    kind = "number" if numeric else "short" if len(text) <= _SHORT else ""
    return f'<td class="{kind}">{escape(text)}</td>' if kind else f"<td>{escape(text)}</td>"


def _figures(folder: Path, figures: Sequence[Figure]) -> str:
    """Return the pictures in a grid."""
    return _grid(_figure(folder / figure.path, figure.caption) for figure in figures)


def _grid(figures: Iterable[str]) -> str:
    shown = "".join(figures)
    return f'<div class="figures">{shown}</div>' if shown else ""


def _figure(path: Path, caption: str) -> str:
    """Return a picture with its data; a wide one scrolls in its own box on a narrow screen."""
    if not path.exists():
        return ""
    data, text = base64.b64encode(path.read_bytes()).decode("ascii"), escape(caption, quote=True)
    image = f'<img alt="{text}" src="data:image/png;base64,{data}">'
    return (
        f'<figure class="picture"><div class="wide" tabindex="0">{image}</div><figcaption>{text}</figcaption></figure>'
    )


def _document(title: str, body: str) -> tuple[str, str]:
    """What comes before the scripts that draw, and what comes after them."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)} - finger3d</title>\n<style>\n{asset('style.css')}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n<script>{_UNFOLD}</script>\n"
    ), "</body>\n</html>\n"
