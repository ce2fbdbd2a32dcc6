"""What commands print: tables, JSON, the headline of a page, errors in one line."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._ranges import printable

if TYPE_CHECKING:
    from rich.table import Table

    from finger3d.report.build import Page


_LONGEST = 4000
"""Most characters of a message, which may quote what a user has typed."""


def print_json(data: Mapping[str, object] | Sequence[object]) -> None:
    """Print JSON. Characters that standard output cannot encode are escaped."""
    from finger3d.io import json_text

    text = json_text(data)
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        text = json.dumps(json.loads(text), indent=2)
    print(text)


def complain(text: str) -> None:
    """Print one line on standard error."""
    line = printable(" ".join(text.split()))
    if len(line) > _LONGEST:
        line = f"{line[: _LONGEST // 2]} ... {line[-_LONGEST // 2 :]}"
    print(f"finger3d: {line}", file=sys.stderr)


def print_rows(title: str, rows: Iterable[tuple[str, object]]) -> None:
    """Print a title and a table of names and values."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    bold = Text(printable(title), style="bold")
    table = Table(box=box.SIMPLE, title=bold, title_justify="left", show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    # Output to a pipe is wide enough for paths, which could not be copied from two lines.
    _print(table, rows, 500)


def print_page(page: Page, files: Iterable[Path]) -> None:
    """Print the title, the headline and the notes of a page, and the files of the result."""
    rows = [(row.name, row.text) for row in page.headline] + [("note", note) for note in page.notes]
    print_rows(page.title, [*rows, *zip(["results", *[""] * 9], files, strict=False)])


def print_columns(head: Sequence[str], lines: Iterable[Sequence[str]]) -> None:
    """Print a table with column names."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE)
    for name in head:
        table.add_column(name, overflow="fold")
    _print(table, lines, 240)


def _print(table: Table, lines: Iterable[Sequence[object]], piped_width: int) -> None:
    """Print a table with lines of cells; asterisks of bold text are left out."""
    from rich.console import Console
    from rich.text import Text

    for line in lines:
        table.add_row(*(Text(printable(str(cell).replace("**", ""))) for cell in line))
    Console(file=sys.stdout, highlight=False, width=None if sys.stdout.isatty() else piped_width).print(table)
