"""What commands print: tables, JSON, the headline of a page, errors in one line; and the streams they print to."""

from __future__ import annotations

import errno
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from finger3d._ranges import printable

if TYPE_CHECKING:
    from rich.table import Table

    from finger3d.report.build import Page


class SafeStream:
    """A text stream whose ``write`` and ``flush`` never fail.

    After the first failure (closed pipe, full disk) all output is discarded. Characters that the encoding lacks are
    written as backslash escapes.

    Parameters
    ----------
    stream : stream to write to; None discards all output

    Attributes
    ----------
    lost : error that ended the output, or None
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream if stream is not None else open(os.devnull, "w", encoding="utf-8")
        self.lost: Exception | None = None
        with suppress(AttributeError, ValueError):  # of a stream in memory, and of a closed one
            self._stream.reconfigure(errors="backslashreplace")

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write text and return its length."""
        self._attempt(lambda: self._stream.write(text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write a sequence of texts."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flush the stream."""
        self._attempt(self._stream.flush)

    def _attempt(self, act: Callable[[], object]) -> None:
        try:
            if self.lost is None:
                act()
        except (OSError, ValueError) as error:
            self.lost = error
            # At exit the interpreter flushes the remaining buffer, which must not fail.
            with suppress(OSError, ValueError):
                target = os.open(os.devnull, os.O_WRONLY)
                os.dup2(target, self._stream.fileno())
                os.close(target)


@contextmanager
def safe_streams() -> Iterator[None]:
    """Replace ``sys.stdout`` and ``sys.stderr`` by streams that never fail, within the block.

    A job thus writes its results even if the terminal is closed. Any failure other than a closed pipe, for instance a
    full disk, is reported on standard error at the end.
    """
    before = sys.stdout, sys.stderr
    out, err = SafeStream(sys.stdout), SafeStream(sys.stderr)
    sys.stdout, sys.stderr = out, err
    try:
        yield
    finally:
        out.flush()
        if isinstance(out.lost, OSError) and out.lost.errno != errno.EPIPE:
            err.write(
                f"finger3d: standard output: {out.lost.strerror or out.lost}; files of results are not affected\n"
            )
        err.flush()
        sys.stdout, sys.stderr = before


_LEAST_COLUMNS = 20
"""Width below which cyclopts and rich break lines without end."""


def fill_descriptors() -> None:
    """Open the null device for closed standard descriptors, which the next opened file would otherwise take."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            os.set_inheritable(number, True)


def least_width() -> None:
    """Let text be at least 20 columns wide on a terminal that says it is narrower."""
    said = os.environ.get("COLUMNS", "")
    width = int(said) if said.isdecimal() else shutil.get_terminal_size().columns
    if width < _LEAST_COLUMNS:
        os.environ["COLUMNS"] = str(_LEAST_COLUMNS)


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
    from rich.text import Text

    bold = Text(printable(title), style="bold")
    table = _table()
    table.title, table.title_justify, table.show_header = bold, "left", False
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for key, value in rows:
        table.add_row(Text(printable(key)), Text(printable(str(value))))
    # Output to a pipe is wide enough for paths, which could not be copied from two lines.
    _print(table, 500)


def print_page(page: Page, files: Iterable[Path]) -> None:
    """Print the title, the headline and the notes of a page, and the files of the result."""
    rows = [(row.name, row.text) for row in page.headline] + [("note", note) for note in page.notes]
    print_rows(page.title, [*rows, *zip(["results", *[""] * 9], files, strict=False)])


def print_columns(head: Sequence[str], lines: Iterable[Sequence[str]]) -> None:
    """Print a table with column names."""
    from rich.text import Text

    table = _table()
    for name in head:
        table.add_column(name, overflow="fold")
    for line in lines:
        table.add_row(*(Text(printable(cell.replace("**", ""))) for cell in line))
    _print(table, 240)


def _table() -> Table:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE)


def _print(table: Table, piped_width: int) -> None:
    from rich.console import Console

    Console(file=sys.stdout, highlight=False, width=None if sys.stdout.isatty() else piped_width).print(table)
