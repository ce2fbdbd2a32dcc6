"""CSV files of measurements and of points: their encoding, separator, decimal mark and line of names."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.io import file_bytes, text_of

_SEPARATORS = ",;\t"
_ONE_COLUMN = "\x1f"
"""Separator of a file with one name, in which a comma is decimal."""

_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?", re.ASCII)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""Numbers whose comma may be decimal or separate thousands."""


@dataclass(frozen=True)
class CsvTable:
    """Rows of a CSV file.

    Attributes
    ----------
    source : name of the file, for messages
    names : of the columns (k)
    separator : of the cells
    lines : (n,) number of the line of each row, from 1
    rows : (n, k) cells, without spaces around them
    """

    source: str
    names: tuple[str, ...]
    separator: str
    lines: tuple[int, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()

    def with_rows(self, lines: Iterable[str], first: int) -> CsvTable:
        """Return the table with the rows in lines of text, the first of which has the number `first`.

        Raises
        ------
        Finger3dError
            For a row with another number of cells than columns.
        """
        uncommented = ("" if _is_comment(line) else line for line in lines)
        reader = csv.reader(uncommented, delimiter=self.separator, strict=True)
        rows, count = {}, len(self.names)
        try:
            for cells in reader:
                line, row = first - 1 + reader.line_num, _stripped(cells)
                row += ("",) * (count - len(row) if len(cells) >= count else 0)
                if any(row) and len(row) != count:
                    raise Finger3dError(
                        f"{self.source}: line {line}: has {len(row)} cells, and there are {count} columns"
                    )
                if any(row):
                    rows[line] = row
        except csv.Error as error:
            raise Finger3dError(f"{self.source}: line {first - 1 + reader.line_num}: {error}") from None
        return replace(self, lines=tuple(rows), rows=tuple(rows.values()))

    def texts(self, names: Iterable[str]) -> dict[str, list[str]]:
        """Return the cells (n,) of columns by name, decimal commas replaced by points.

        Raises
        ------
        Finger3dError
            If some numbers have commas and others points, or commas may separate thousands.
        """
        at = {name: self.names.index(name) for name in names}
        numbers = [
            (f"{self.source}: line {line}: {name} = '{row[k]}'", row[k])
            for line, row in zip(self.lines, self.rows, strict=True)
            for name, k in at.items()
            if _NUMBER.fullmatch(row[k])
        ]
        comma = [(where, text) for where, text in numbers if "," in text]
        point = next((where for where, text in numbers if "." in text), "").removeprefix(f"{self.source}: ")
        if comma and point:
            raise Finger3dError(f"{comma[0][0]}: has a comma, and {point} has a point; write all numbers with a point")
        if comma and all(_THOUSANDS.fullmatch(text) for _, text in comma):
            where, text = comma[0]
            either = f"{text.replace(',', '.')} or {text.replace(',', '')}"
            raise Finger3dError(f"{where}: may be {either}; write numbers with a decimal point")
        return {
            name: [row[k].replace(",", ".") if _NUMBER.fullmatch(row[k]) else row[k] for row in self.rows]
            for name, k in at.items()
        }

    def numbers(self, names: Iterable[str]) -> dict[str, Float]:
        """Return the numbers (n,) of columns by name.

        Raises
        ------
        Finger3dError
            For a cell that is no finite number, and as `texts` does.
        """
        return {
            name: np.array([self._number(line, name, cell) for line, cell in zip(self.lines, cells, strict=True)])
            for name, cells in self.texts(names).items()
        }

    def _number(self, line: int, name: str, text: str) -> float:
        where = f"{self.source}: line {line}: {name}"
        if not text:
            raise Finger3dError(f"{where} is empty; leave out the row, or the column")
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if not math.isfinite(value):
            hint = ", without a mark of thousands" if "," in text else ""
            hint = "; it has more cells than names" if self.separator == _ONE_COLUMN and hint else hint
            raise Finger3dError(f"{where} = {text!r:.40}: must be a finite number{hint}")
        return value


def read_table(path: Path, is_name: Callable[[str], bool]) -> CsvTable:
    """Read a CSV file.

    Lines that begin with # or % are comments, and a first line such as ``sep=;`` gives the separator.  Lines before
    that of the names are passed over.

    Parameters
    ----------
    is_name : whether a cell is the name of a column, by which the line of names and the separator are known

    Raises
    ------
    Finger3dError
        If the file cannot be read, is no text, a name occurs twice, or a row has another number of cells.
    """
    lines = io.StringIO(decoded(str(path), file_bytes(path)), newline=None).readlines()
    table, used = with_names(str(path), lines, is_name)
    return table.with_rows(lines[used:], used + 1) if table.names else table


def decoded(source: str, content: bytes) -> str:
    """Return the text of a file; see `finger3d.io.text_of`.

    Raises
    ------
    Finger3dError
        If it is no text.
    """
    try:
        return text_of(content)
    except ValueError as error:
        raise Finger3dError(f"{source}: {error}; save it as CSV in UTF-8") from None


def with_names(source: str, lines: Sequence[str], is_name: Callable[[str], bool]) -> tuple[CsvTable, int]:
    """Return a table without rows, and the number of lines up to the line of names.

    Among the lines before the first row of numbers it is the one with most names; without any, that with most cells.

    Raises
    ------
    Finger3dError
        If a name occurs twice.
    """
    given = re.match(r'"?sep=(.)', lines[0]) if lines else None
    best, found, used = (-1, False, 0), CsvTable(source, (), _ONE_COLUMN), 0
    for number, line in enumerate(lines[1:] if given else lines, start=2 if given else 1):
        candidates = {s: _cells(line.lstrip("#% "), s) for s in ([given[1]] if given else _SEPARATORS)}
        ranks = {s: (sum(map(is_name, cells)), not _is_comment(line), len(cells)) for s, cells in candidates.items()}
        separator = max(ranks, key=lambda s: ranks[s])
        names, rank = candidates[separator], ranks[separator]
        if is_row(line) or (rank[0] == 0 < best[0] and len(names) == len(found.names)):
            break
        if names and rank > best:
            own = separator if given or separator in line else _ONE_COLUMN
            best, found, used = rank, CsvTable(source, names, own), number
    twice = next((name for i, name in enumerate(found.names) if name and name in found.names[:i]), None)
    if twice is not None:
        raise Finger3dError(f'{source}: two columns are called "{twice}"')
    return found, used


def is_row(line: str) -> bool:
    """Return whether a line holds numbers only."""
    return any(cells and all(map(_NUMBER.fullmatch, cells)) for cells in (_cells(line, s) for s in _SEPARATORS))


def _is_comment(line: str) -> bool:
    return line.startswith(("#", "%"))


def _cells(line: str, separator: str) -> tuple[str, ...]:
    """Return the cells of a line; none of one that csv cannot split."""
    try:
        return _stripped(next(csv.reader([line], delimiter=separator), []))
    except csv.Error:
        return ()


def _stripped(cells: Sequence[str]) -> tuple[str, ...]:
    """Return cells without spaces around them, and without empty ones at the end."""
    texts = [cell.strip() for cell in cells]
    while texts and not texts[-1]:
        texts.pop()
    return tuple(texts)
