"""Command ``estimate``: the friction coefficient from readings."""

from __future__ import annotations

import csv
import io
import math
import os
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from finger3d.cli.common import Json, app, print_json
from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from finger3d._types import Float, Tree
    from finger3d.csv_table import CsvTable
    from finger3d.sensor import Calibration, Estimate

_POLL_S = 0.02
"""Time between two looks at a file that is followed."""

_COLUMNS = ("mu", "std", "low", "high", "status", "chi_square", "p_value", "verdict")
"""Columns of an estimate that follow those of its readings."""


@app.command
def estimate(
    calibration: Path,
    /,
    *,
    strain: Annotated[
        list[str] | None,
        Parameter(
            negative=(),
            allow_leading_hyphen=True,
            help="A reading; or NAME=READING, repeated for each of several calibrated readings.",
        ),
    ] = None,
    std: Annotated[
        list[str] | None,
        Parameter(
            negative=(),
            allow_leading_hyphen=True,
            help="Standard deviation of the readings, or NAME=NUMBER for one of several; default: the noise of the "
            "calibration.",
        ),
    ] = None,
    csv_: Annotated[
        Path | None,
        Parameter(
            name="--csv",
            help="CSV file of readings: a column for each, NAME, and optionally NAME_std; of a single reading strain "
            "and std will do.",
        ),
    ] = None,
    follow: Annotated[
        str | None,
        Parameter(
            allow_leading_hyphen=True, help="The same, with lines still being written: a file, or - for standard input."
        ),
    ] = None,
    out: Annotated[Path | None, Parameter(help="CSV file for the estimates from --csv; default: print them.")] = None,
    json_: Json = False,
    curve: Annotated[
        Literal["interpolation", "fit"],
        Parameter(help="Curve of the readings over mu: the monotone interpolation or the second-order fit."),
    ] = "interpolation",
    tolerances: Annotated[
        bool,
        Parameter(
            negative="--no-tolerances", help="Include the tolerances of the calibration in the standard deviation."
        ),
    ] = True,
) -> None:
    """Estimate mu and its standard deviation from readings, or report why they do not determine mu.

    Example: finger3d estimate cal/calibration.json --strain 0.052

    With --follow an estimate is printed as soon as its reading is written, until standard input ends or Ctrl-C. A line
    that is no reading has the status invalid and the reason; a file that is replaced or cut is read from its start.

    Parameters
    ----------
    calibration
        The calibration.json that `finger3d calibrate` wrote.
    """
    from finger3d.sensor import load as read

    if sum(given is not None for given in (strain, csv_, follow)) != 1:
        raise Finger3dError("estimate: give either --strain NUMBER, --csv FILE or --follow FILE")
    if out is not None and csv_ is None:
        raise Finger3dError("estimate: --out goes with --csv")
    job = _Job.of(read(calibration), std or (), curve, tolerances)
    if strain is not None:
        (result,) = job.estimates(job.named("--strain", strain), job.given_stds)
        if json_:
            print_json(asdict(result))
        else:
            print(result.verdict)
    elif follow is not None:
        for line in _followed(job, follow):
            print(line, flush=True)
    elif csv_ is not None:
        _estimate_file(job, csv_, out, json_)


def _estimate_file(job: _Job, path: Path, out: Path | None, json_: bool) -> None:
    """Write or print an estimate for each line of a CSV file."""
    from finger3d.csv_table import read_table  # loads NumPy, which --help can do without

    table = read_table(path, job.is_column)
    job.check_columns(table)
    readings, stds = job.readings_in(table)
    try:
        every = job.estimates(readings, stds)
    except Finger3dError as error:
        raise Finger3dError(f"{path}: {error}") from None
    if json_:
        print_json([asdict(e) for e in every])
    elif out is None:
        print("\n".join(map(_csv_line, [job.columns, *map(job.line, every)])))
    else:
        from finger3d.io import write_csv

        lines = [job.line(e) for e in every]
        columns: Tree = {name: [line[i] for line in lines] for i, name in enumerate(job.columns)}
        write_csv(out, columns)
        determined = sum(e.is_determined for e in every)
        print(f"{determined} of {len(every)} readings determine mu; results: {out}")


@dataclass(frozen=True)
class _Job:
    """A calibration, standard deviations by name, and how readings are to be turned into mu."""

    calibration: Calibration
    given_stds: dict[str, float]
    curve: Literal["interpolation", "fit"]
    tolerances: bool

    @classmethod
    def of(
        cls,
        calibration: Calibration,
        stds: Sequence[str],
        curve: Literal["interpolation", "fit"],
        tolerances: bool,
    ) -> _Job:
        """Return a job with the standard deviations of ``--std``."""
        plain = cls(calibration, {}, curve, tolerances)
        return replace(plain, given_stds=plain.named("--std", stds, plain_for_all=True))

    @property
    def names(self) -> tuple[str, ...]:
        return self.calibration.names

    def named(self, option: str, texts: Sequence[str], plain_for_all: bool = False) -> dict[str, float]:
        """Return the numbers of an option by name: of ``NAME=NUMBER``, or of the plain number for a single reading."""
        numbers: dict[str, float] = {}
        for text in texts:
            name, equals, value = text.rpartition("=")
            try:
                number = float(value)
            except ValueError:
                raise Finger3dError(f"{option} {text}: must be a number, or NAME=NUMBER") from None
            for one in self._meant(option, text, name.strip() if equals else "", plain_for_all):
                if one in numbers:
                    raise Finger3dError(f"{option} {text}: {one} is given twice")
                numbers[one] = number
        return numbers

    def _meant(self, option: str, text: str, name: str, plain_for_all: bool) -> tuple[str, ...]:
        """Return the readings that a name stands for."""
        if name in self.names:
            return (name,)
        if name:
            raise Finger3dError(f"{option} {text}: {name} is not calibrated; calibrated: {', '.join(self.names)}")
        if len(self.names) == 1 or (plain_for_all and len({c.kind for c in self.calibration.readings}) == 1):
            return self.names
        raise Finger3dError(
            f"{option} {text}: {', '.join(self.names)} are calibrated; give the name of the reading, for instance "
            f"{option} {self.names[0]}={text}"
        )

    def estimates(self, values: Mapping[str, ArrayLike], stds: Mapping[str, ArrayLike]) -> Sequence[Estimate]:
        """Return an estimate for each set of readings."""
        from finger3d.sensor import estimate as run

        return run(self.calibration, values, stds, self.curve, self.tolerances)

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the estimates."""
        return (*self.names, *_COLUMNS)

    def line(self, estimate: Estimate) -> list[object]:
        """Return the cells of an estimate."""
        return [*estimate.readings.values(), *(getattr(estimate, name) for name in _COLUMNS)]

    @property
    def column_names(self) -> dict[str, tuple[str, ...]]:
        """Names that the columns of a file may have, by ``NAME`` and ``NAME_std``."""
        own = [name for reading in self.names for name in (reading, f"{reading}_std")]
        short = ("strain", "std") if len(self.names) == 1 else own
        return dict(zip(own, zip(own, short, strict=True), strict=True))

    def is_column(self, cell: str) -> bool:
        """Return whether a cell is the name of a column."""
        return any(cell in names for names in self.column_names.values())

    def columns_in(self, table: CsvTable) -> dict[str, str]:
        """Return the columns of a file for ``NAME`` and ``NAME_std``, as far as it has them."""
        found = {name: [n for n in names if n in table.names] for name, names in self.column_names.items()}
        return {name: columns[0] for name, columns in found.items() if columns}

    def check_columns(self, table: CsvTable) -> None:
        """Raise an error if a column of readings is missing."""
        if missing := [
            " or ".join(dict.fromkeys(self.column_names[n])) for n in self.names if n not in self.columns_in(table)
        ]:
            has = ", ".join(repr(name)[:40] for name in table.names) or "no line of names"
            raise Finger3dError(
                f"{table.source}: must have a column named {' and one named '.join(missing)} and at least one reading; "
                f"it has {has}"
            )

    def readings_in(self, table: CsvTable) -> tuple[dict[str, Float], dict[str, Float | float]]:
        """Return the readings and their standard deviations by name; ``--std`` where a file has no column for one."""
        columns = self.columns_in(table)
        numbers = table.numbers(columns.values())
        values = {name: numbers[column] for name, column in columns.items()}
        own = {name: values[f"{name}_std"] for name in self.names if f"{name}_std" in values}
        return {name: values[name] for name in self.names}, {**self.given_stds, **own}


def _followed(job: _Job, source: str) -> Iterator[str]:
    """Yield a line of names, and a line for each reading as soon as it is written.

    A line that is no reading is answered with the reason, so that it does not stop a robot.
    """
    from finger3d.csv_table import decoded, is_row, with_names

    yield _csv_line(job.columns)
    head, table, number = list[str](), None, 0
    for content in _written_lines(source):
        number, head = (number + 1, head) if content else (0, [])
        try:
            line = decoded(source, content)
            found, _ = with_names(source, [*head, line], job.is_column)
            if set(job.names) <= set(job.columns_in(found)):  # also in a file that has replaced another
                head, table = [], found
            elif table is None:
                head.append(line)
                if is_row(line):
                    job.check_columns(found)
            elif (row := table.with_rows([line], number)).rows:
                (answer,) = job.estimates(*job.readings_in(row))
                yield _csv_line(job.line(answer))
        except Finger3dError as error:
            if table is None:
                raise
            nothing = dict.fromkeys(job.columns, math.nan)
            yield _csv_line((nothing | {"status": "invalid", "verdict": str(error)}).values())
    if table is None and head:
        job.check_columns(found)


def _written_lines(source: str) -> Iterator[bytes]:
    """Yield the lines of a file as they are written, without end; those of standard input until it ends.

    An empty line says that the file was replaced by another, or cut: what follows is from the start.
    """
    if source == "-":
        yield from sys.stdin.buffer
        return
    stream, begun = _opened(source), b""
    try:
        while True:
            begun += stream.readline()
            if begun.endswith(b"\n"):
                yield begun
                begun = b""
            elif _is_replaced(stream, source):
                stream.close()
                stream, begun = _opened(source), b""
                yield b""
            else:
                time.sleep(_POLL_S)
    finally:
        stream.close()


def _opened(source: str) -> IO[bytes]:
    try:
        return Path(source).open("rb")
    except OSError as error:
        raise Finger3dError(f"{source}: cannot be read: {error.strerror}") from None


def _is_replaced(stream: IO[bytes], source: str) -> bool:
    """Return whether the file of this name is another one than that which is read, or is shorter than what was read."""
    try:
        now, read = os.stat(source), os.fstat(stream.fileno())
    except FileNotFoundError:
        return False  # between the removal of the old file and the creation of the new one
    return (now.st_dev, now.st_ino) != (read.st_dev, read.st_ino) or now.st_size < stream.tell()


def _csv_line(cells: Iterable[object]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(cells)
    return text.getvalue()
