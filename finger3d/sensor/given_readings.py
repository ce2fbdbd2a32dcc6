"""Friction coefficient from readings of a calibrated sensor, also from readings that are given as text."""

from __future__ import annotations

import csv
import io
import math
import os
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float
from finger3d.csv_table import CsvTable, decoded, is_row, read_table, with_names
from finger3d.errors import Finger3dError
from finger3d.sensor.calibration import Calibration, load
from finger3d.sensor.curve import LARGEST_STRAIN, QUANTITIES
from finger3d.sensor.likelihood import Estimate


def estimate(
    calibration: Calibration | str | Path,
    strain: ArrayLike | Mapping[str, ArrayLike],
    std: ArrayLike | Mapping[str, ArrayLike] | None = None,
    tolerances: bool = True,
) -> list[Estimate]:
    """Estimate the friction coefficient from readings.

    Parameters
    ----------
    calibration : what `finger3d.calibrate` returned, or the path of its calibration.json
    strain : one reading, or (m,) of them; of several calibrated readings a mapping with those of each by its name,
        where readings of broken sensors may be left out
    std : standard deviation of each, 0 allowed; None: the noise of the calibration
    tolerances : whether tolerances count; they do not for a sensor whose own curve was measured

    Returns
    -------
    list of Estimate
        For each reading, or set of readings, with ``mu``, ``std`` and ``status``.

    Raises
    ------
    Finger3dError
        For a reading that is no finite number, a name that was not calibrated, or a std that is not from 0 up.
    """
    if isinstance(calibration, str | Path):
        calibration = load(calibration)
    named = _named(calibration, strain)
    names = tuple(name for name in calibration.names if name in named)
    chosen = calibration if len(names) == len(calibration.names) else calibration.of(names)
    rows = [_row(name, named[name], -LARGEST_STRAIN) for name in names]
    stds = [_row(f"std of {name}", values, 0.0) for name, values in zip(names, _stds(chosen, std), strict=True)]
    count = len(rows[0])
    for name, row, std_row in zip(names, rows, stds, strict=True):
        if len(row) != count:
            raise Finger3dError(f"{name}: {len(row)} readings, but {count} of {names[0]}; a set has one of each")
        if len(std_row) not in (1, count):
            raise Finger3dError(f"std of {name}: {len(std_row)} for {count} readings; give one for all, or each")
    noise = np.stack([np.broadcast_to(std_row, count) for std_row in stds], axis=-1)
    return chosen.estimates(np.stack(rows, axis=-1), noise, tolerances)


def _named(calibration: Calibration, readings: ArrayLike | Mapping[str, ArrayLike]) -> Mapping[str, ArrayLike]:
    """Return the readings by name; that of a single calibrated reading may be given without."""
    if not isinstance(readings, Mapping) and len(calibration.names) == 1:
        return {calibration.names[0]: readings}
    if not isinstance(readings, Mapping) or not readings:
        raise Finger3dError(
            f"a reading without a name: {', '.join(calibration.names)} are calibrated, so that every reading needs its "
            f"name, for instance {calibration.names[0]}=0.05"
        )
    for name in readings:
        calibration[name]  # an unknown name raises an error
    return readings


def _stds(calibration: Calibration, std: ArrayLike | Mapping[str, ArrayLike] | None) -> list[ArrayLike]:
    """Return the standard deviations of every reading."""
    if isinstance(std, Mapping):
        for name in std:
            if name not in calibration.names:
                raise Finger3dError(f"std of {name}: no such reading; there are {', '.join(calibration.names)}")
        return [std.get(c.name, c.noise) for c in calibration.readings]
    if std is None:
        return [c.noise for c in calibration.readings]
    if len({c.kind for c in calibration.readings}) > 1:
        units = ", ".join(f"{c.name} in {QUANTITIES[c.kind][1].replace('1', 'strain')}" for c in calibration.readings)
        raise Finger3dError(f"std: the readings have several units ({units}); give one with its name for each")
    return [std for _ in calibration.readings]


def _row(name: str, values: ArrayLike, least: float) -> Float:
    """Return values (m,), all from `least` to `LARGEST_STRAIN`."""
    row = np.atleast_1d(np.asarray(values, dtype=float)).ravel()
    bad = ~((row >= least) & (row <= LARGEST_STRAIN))
    if bad.any():
        i = int(np.argmax(bad))
        where = f" (reading {i + 1} of {len(row)})" if len(row) > 1 else ""
        raise Finger3dError(f"{name} = {row[i]}{where}: must be a finite number from {least:g} to {LARGEST_STRAIN:g}")
    return row


_POLL_S = 0.02
"""Time between two looks at a file that is followed."""

_OF_MU = ("mu", "std", "low", "high", "status", "chi_square", "p_value", "verdict")
"""Columns of an estimate that follow those of its readings."""


def named_numbers(
    calibration: Calibration, option: str, texts: Sequence[str], plain_for_all: bool = False
) -> dict[str, float]:
    """Return the numbers of an option by the names of readings.

    Parameters
    ----------
    option : for messages
    texts : ``NAME=NUMBER``, or a plain number, which is that of a single calibrated reading
    plain_for_all : whether a plain number is that of every reading, if all are of one kind

    Raises
    ------
    Finger3dError
        For text that is no number, an unknown name, or a number given twice.
    """
    names, numbers = calibration.names, dict[str, float]()
    alike = len(names) == 1 or (plain_for_all and len({c.kind for c in calibration.readings}) == 1)
    for text in texts:
        name, _, value = text.rpartition("=")
        name = name.strip()
        try:
            number = float(value)
        except ValueError:
            raise Finger3dError(f"{option} {text}: must be a number, or NAME=NUMBER") from None
        if name and name not in names:
            raise Finger3dError(f"{option} {text}: {name} is not calibrated; calibrated: {', '.join(names)}")
        if not name and not alike:
            raise Finger3dError(
                f"{option} {text}: {', '.join(names)} are calibrated; give the name of the reading, for instance "
                f"{option} {names[0]}={text}"
            )
        for one in (name,) if name else names:
            if one in numbers:
                raise Finger3dError(f"{option} {text}: {one} is given twice")
            numbers[one] = number
    return numbers


@dataclass(frozen=True)
class Estimator:
    """A calibration, and how readings are turned into mu.

    Attributes
    ----------
    stds : standard deviations by the names of readings; the noise of the calibration where there is none
    tolerances : see `estimate`
    """

    calibration: Calibration
    stds: Mapping[str, float]
    tolerances: bool = True

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the estimates."""
        return (*self.calibration.names, *_OF_MU)

    @staticmethod
    def cells(estimate: Estimate) -> list[Any]:
        """Return the cells of an estimate, in the order of `columns`."""
        return [*estimate.readings.values(), *(getattr(estimate, name) for name in _OF_MU)]

    def estimates(self, readings: Mapping[str, ArrayLike], stds: Mapping[str, ArrayLike]) -> list[Estimate]:
        """Return an estimate for each set of readings."""
        return estimate(self.calibration, readings, {**self.stds, **stds}, self.tolerances)

    def of_file(self, path: Path) -> list[Estimate]:
        """Return an estimate for each row of a CSV file."""
        table = read_table(path, self._is_column)
        self._check_columns(table)
        readings, stds = self._readings_in(table)
        try:
            return self.estimates(readings, stds)
        except Finger3dError as error:
            raise Finger3dError(f"{path}: {error}") from None

    def followed(self, source: str) -> Iterator[str]:
        """Yield a line of names, and a line for each reading of a CSV file, or of ``-``, as soon as it is written.

        A line that is no reading is answered with the reason, so that it does not stop a robot.
        """
        yield csv_line(self.columns)
        head, table, number = list[str](), None, 0
        for content in _written_lines(source):
            number, head = (number + 1, head) if content else (0, [])
            try:
                line = decoded(source, content)
                found, _ = with_names(source, [*head, line], self._is_column)
                if set(self.calibration.names) <= set(self._columns_in(found)):  # also in a file that replaced another
                    head, table = [], found
                elif table is None:
                    head.append(line)
                    if is_row(line):
                        self._check_columns(found)
                elif (row := table.with_rows([line], number)).rows:
                    (answer,) = self.estimates(*self._readings_in(row))
                    yield csv_line(self.cells(answer))
            except Finger3dError as error:
                if table is None:
                    raise
                nothing = dict.fromkeys(self.columns, math.nan)
                yield csv_line((nothing | {"status": "invalid", "verdict": str(error)}).values())
        if table is None and head:
            self._check_columns(found)

    @property
    def _column_names(self) -> dict[str, tuple[str, ...]]:
        """Names that the columns of a file may have, by ``NAME`` and ``NAME_std``."""
        names = self.calibration.names
        own = [name for reading in names for name in (reading, f"{reading}_std")]
        return dict(zip(own, zip(own, ("strain", "std") if len(names) == 1 else own, strict=True), strict=True))

    def _is_column(self, cell: str) -> bool:
        return any(cell in names for names in self._column_names.values())

    def _columns_in(self, table: CsvTable) -> dict[str, str]:
        """Return the columns of a file for ``NAME`` and ``NAME_std``, as far as it has them."""
        found = {name: [n for n in names if n in table.names] for name, names in self._column_names.items()}
        return {name: columns[0] for name, columns in found.items() if columns}

    def _check_columns(self, table: CsvTable) -> None:
        """Raise an error if a column of readings is missing."""
        there = self._columns_in(table)
        missing = [" or ".join(dict.fromkeys(self._column_names[n])) for n in self.calibration.names if n not in there]
        if missing:
            has = ", ".join(repr(name)[:40] for name in table.names) or "no line of names"
            raise Finger3dError(
                f"{table.source}: must have a column named {' and one named '.join(missing)} and at least one reading; "
                f"it has {has}"
            )

    def _readings_in(self, table: CsvTable) -> tuple[dict[str, Float], dict[str, Float]]:
        """Return the readings, and those of their standard deviations that the file has, by name."""
        columns = self._columns_in(table)
        numbers = table.numbers(columns.values())
        values = {name: numbers[column] for name, column in columns.items()}
        names = self.calibration.names
        stds = {name: values[f"{name}_std"] for name in names if f"{name}_std" in values}
        return {name: values[name] for name in names}, stds


def csv_line(cells: Iterable[object]) -> str:
    """Return cells as a line of a CSV file, without its end."""
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(cells)
    return text.getvalue()


def _written_lines(source: str) -> Iterator[bytes]:
    """Yield the lines of a file as they are written, without end; those of standard input until it ends.

    An empty line says that the file was replaced by another, or cut: what follows is from the start.
    """
    if source == "-":
        yield from sys.stdin.buffer
        return
    while True:
        try:
            stream = Path(source).open("rb")
        except OSError as error:
            raise Finger3dError(f"{source}: cannot be read: {error.strerror}") from None
        with stream:
            begun = b""
            while True:
                begun += stream.readline()
                if begun.endswith(b"\n"):
                    yield begun
                    begun = b""
                elif _is_replaced(stream.fileno(), stream.tell(), source):
                    break
                else:
                    time.sleep(_POLL_S)
        yield b""


def _is_replaced(descriptor: int, position: int, source: str) -> bool:
    """Return whether the file of this name is another one than that which is read, or is shorter than what was read."""
    try:
        now, read = os.stat(source), os.fstat(descriptor)
    except FileNotFoundError:
        return False  # between the removal of the old file and the creation of the new one
    return (now.st_dev, now.st_ino) != (read.st_dev, read.st_ino) or now.st_size < position
