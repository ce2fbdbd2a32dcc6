"""Measured presses: CSV files whose columns are named as those of history.csv, checked line by line."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.scene.messages import listed, nearest

INDEX = ("step", "time_s", "depth_mm")
"""Columns that say when a row was measured; the first of them that a file has counts."""

_CLOCKS = ("step", "time_s")
"""Columns that are never fitted, unlike the depth, which is fitted if it does not locate the rows."""

STD = "_std"

_FEWEST = 2
"""Least number of rows of a measured press."""

_OPPOSITE = -0.5
"""Cosine between a measured and a simulated column below which they have opposite signs."""

_LEAST_STD, _LARGEST_STD = 1e-12, 1e12
"""Standard deviations, in the unit of their column: squares of the residuals over them neither overflow nor vanish."""

_UNIT_RATIO = 30.0
"""Ratio of a measured column to the simulated one beyond which its unit is in doubt; 100 is a percentage."""


@dataclass(frozen=True)
class MeasuredPress:
    """Measured press of n rows.

    Attributes
    ----------
    path : of the file
    index : name of the column that says when a row was measured, one of `INDEX`
    at : (n,) its values, ascending
    columns : (n,) values by name
    stds : (n,) standard deviations by name, of the columns that have them
    """

    path: Path
    index: str
    at: Float
    columns: Mapping[str, Float]
    stds: Mapping[str, Float]

    @property
    def count(self) -> int:
        """Number of measured values."""
        return len(self.at) * len(self.columns)

    def check_signs(self, simulated: Sequence[Mapping[str, Float]]) -> None:
        """Raise an error for a column that has the opposite sign of all simulated ones (n,), by name."""
        for name, values in self.columns.items():
            if all(
                values @ one[name] < _OPPOSITE * np.linalg.norm(values) * np.linalg.norm(one[name]) for one in simulated
            ):
                row = int(np.argmax(np.abs(values)))
                raise Finger3dError(
                    f"{self.path}: line {row + 2}: {name} = {values[row]:g}: the scene gives "
                    f"{simulated[0][name][row]:.2g}, of the opposite sign; a force that presses is positive, and so is "
                    "a strain that lengthens"
                )

    def check_units(self, smallest: Mapping[str, float], largest: Mapping[str, float]) -> None:
        """Raise an error for a column whose magnitude is far from that of the simulated ones.

        Parameters
        ----------
        smallest, largest : by name, the largest magnitude of a column over the press, for the free keys at their bounds
        """
        for name, values in self.columns.items():
            row = int(np.argmax(np.abs(values)))
            found = abs(float(values[row]))
            if not smallest[name] / _UNIT_RATIO <= found <= largest[name] * _UNIT_RATIO:
                raise Finger3dError(
                    f"{self.path}: line {row + 2}: {name} = {values[row]:g}: the scene gives up to "
                    f"{smallest[name]:.2g} to {largest[name]:.2g}; is the unit that of the name (strain is a plain "
                    "number, not percent), and the sensor the right one?"
                )


def read_measured(path: Path, known: Sequence[str]) -> MeasuredPress:
    """Read a measured press.

    Parameters
    ----------
    path : CSV file with a line of names, then a line for each row; with semicolons or tabs the comma is decimal
    known : names that columns may have, besides those of `INDEX`

    Raises
    ------
    Finger3dError
        In one line: for a file that cannot be read, an unknown column, a gap, a value that is no number, rows out of
        order.
    """
    names, rows = _table(path)
    index = next((name for name in INDEX if name in names), None)
    if index is None:
        raise Finger3dError(f"{path}: must have a column {listed(INDEX)}, which says when a row was measured")
    columns = [n for n in names if n not in (index, *_CLOCKS) and not n.endswith(STD)]
    for name in names:
        base = name.removesuffix(STD)
        if base not in known and base not in INDEX:
            near = next((n for n in known if n.endswith(f"_{base}")), None) or nearest(base, list(known))
            hint = f'did you mean "{near}"? ' if near else ""
            raise Finger3dError(
                f'{path}: column "{name}": {hint}it is none of the forces, lengths, areas, energies and readings of '
                "history.csv, which are fitted; leave out other columns"
            )
        if name.endswith(STD) and base not in columns:
            raise Finger3dError(f'{path}: column "{name}" has no column "{base}"')
    if not columns:
        raise Finger3dError(f"{path}: has no measured column beside {index}; for instance normal_force_N")
    values = {name: np.array([_number(path, line, name, row[name]) for line, row in rows]) for name in names}
    at = values[index]
    falling = np.flatnonzero(np.diff(at) <= 0.0)
    if len(falling):
        line = rows[int(falling[0]) + 1][0]
        more = "; of a press that goes back, give time_s or step" if index == "depth_mm" else ""
        raise Finger3dError(f"{path}: line {line}: {index} = {at[falling[0] + 1]:g}: must be larger than before{more}")
    if len(at) < _FEWEST:
        raise Finger3dError(f"{path}: has {len(at)} rows; at least {_FEWEST} are needed")
    stds = {n: values[n + STD] for n in columns if n + STD in values}
    for name, own in stds.items():
        bad = np.flatnonzero((own < _LEAST_STD) | (own > _LARGEST_STD))
        if len(bad):
            line = rows[int(bad[0])][0]
            raise Finger3dError(
                f"{path}: line {line}: {name}{STD} = {own[bad[0]]:g}: must be from {_LEAST_STD:g} to {_LARGEST_STD:g}"
            )
    return MeasuredPress(path, index, at, {n: values[n] for n in columns}, stds)


def _table(path: Path) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Return the names and the rows, with the number of their lines."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            separator = _separator(stream.readline())
            stream.seek(0)
            reader = csv.reader(stream, delimiter=separator)
            names = [name.strip() for name in next(reader, [])]
            lines = [(reader.line_num, cells) for cells in reader if cells]
            if separator != ",":  # where the comma is decimal
                lines = [(line, [cell.replace(",", ".") for cell in cells]) for line, cells in lines]
    except FileNotFoundError:
        raise Finger3dError(f"{path}: there is no such file") from None
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise Finger3dError(f"{path}: not a CSV file; it must have a line of names, then a line for each row") from None
    twice = next((n for i, n in enumerate(names) if n in names[:i]), None)
    if twice is not None:
        raise Finger3dError(f'{path}: two columns are called "{twice}"')
    for line, cells in lines:
        if len(cells) != len(names):
            raise Finger3dError(f"{path}: line {line}: has {len(cells)} cells, and there are {len(names)} columns")
    return names, [(line, dict(zip(names, cells, strict=True))) for line, cells in lines]


def _separator(names: str) -> str:
    """Return what separates the names: semicolons and tabs are those of languages with a decimal comma."""
    return max(",;\t", key=names.count)


def _number(path: Path, line: int, name: str, text: str) -> float:
    if not text.strip():
        raise Finger3dError(f"{path}: line {line}: {name} is empty; leave out the row, or the column")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise Finger3dError(f"{path}: line {line}: {name} = {text.strip()!r:.40}: must be a finite number")
    return value
