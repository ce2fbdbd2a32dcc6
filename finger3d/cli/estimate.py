"""Command ``estimate``: the friction coefficient from readings."""

from __future__ import annotations

import csv
import math
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from finger3d.cli.common import Json, app, print_json
from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from finger3d._types import Tree
    from finger3d.sensor import Calibration, Estimate

_POLL_S = 0.02
"""Time between two looks at a file that is followed."""

_LONGEST_LINE = 65536
"""Characters of a line of a stream beyond which it is no line of readings."""

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
    values, stds = _readings(job, path)
    try:
        every = job.estimates(values, stds)
    except Finger3dError as error:
        raise Finger3dError(f"{path}: {error}") from None
    if json_:
        print_json([asdict(e) for e in every])
    elif out is None:
        print("\n".join([",".join(map(_cell, job.columns)), *(",".join(map(_cell, job.line(e))) for e in every)]))
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

    def estimates(
        self, values: Mapping[str, Sequence[float] | float], stds: Mapping[str, Sequence[float] | float]
    ) -> Sequence[Estimate]:
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

    def columns_of(self, source: Path | str, names: Sequence[str]) -> dict[str, str]:
        """Return the columns of a file for ``NAME`` and ``NAME_std``; a missing column of readings is an error."""
        columns = {name: name for one in self.names for name in (one, f"{one}_std") if name in names}
        if len(self.names) == 1:  # a single reading may be called strain
            short = {self.names[0]: "strain", f"{self.names[0]}_std": "std"}
            columns = {name: column for name, column in short.items() if column in names} | columns
        missing = [name for name in self.names if name not in columns]
        missing = [f"{missing[0]} or strain"] if missing and len(self.names) == 1 else missing
        if missing:
            has = ", ".join(repr(name)[:40] for name in names) or "nothing"
            raise Finger3dError(
                f"{source}: must have a column named {' and one named '.join(missing)} and at least one reading; it "
                f"has {has}"
            )
        return columns


def _followed(job: _Job, source: str) -> Iterator[str]:
    """Yield a line of names, and a line for each reading as soon as it is written.

    A line that is no reading is answered with the reason, so that it does not stop a robot.
    """
    yield ",".join(map(_cell, job.columns))
    names: list[str] = []
    columns: dict[str, str] = {}
    number = 0
    for line in _written_lines(source):
        number = number + 1 if line else 0
        if line == "\n" or not line:
            continue
        cells = next(csv.reader([line]), []) if len(line) <= _LONGEST_LINE else []
        stripped = [cell.strip() for cell in cells]
        if not columns or (number == 1 and set(stripped) >= set(columns.values())):
            names, columns = stripped, job.columns_of(source, stripped)
            continue
        try:
            row = dict(zip(names, cells, strict=False))
            values = {name: _number(source, number, column, row) for name, column in columns.items()}
            stds = job.given_stds | {name: values[f"{name}_std"] for name in job.names if f"{name}_std" in values}
            (answer,) = job.estimates({name: values[name] for name in job.names}, stds)
            answered = job.line(answer)
        except Finger3dError as error:
            nothing = dict.fromkeys(job.columns, math.nan)
            answered = list((nothing | {"status": "invalid", "verdict": str(error)}).values())
        yield ",".join(map(_cell, answered))


def _written_lines(source: str) -> Iterator[str]:
    """Yield the lines of a file as they are written, without end; those of standard input until it ends.

    An empty string says that the file was replaced by another, or cut: what follows is from the start.
    """
    if source == "-":
        for whole in sys.stdin.buffer:
            yield whole.decode("utf-8-sig", errors="replace")
        return
    stream, begun = _opened(source), b""
    try:
        while True:
            begun += stream.readline()
            if begun.endswith(b"\n"):
                yield begun.decode("utf-8-sig", errors="replace")
                begun = b""
            elif _is_replaced(stream, source):
                stream.close()
                stream, begun = _opened(source), b""
                yield ""
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


def _cell(value: object) -> str:
    if isinstance(value, float):
        return repr(value)
    text = str(value)
    return '"' + text.replace('"', '""') + '"' if "," in text or '"' in text else text


def _readings(job: _Job, path: Path) -> tuple[dict[str, list[float]], dict[str, list[float] | float]]:
    """Read readings and their standard deviations by name from a CSV file; ``--std`` where it has no column for one."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.DictReader(stream))
    except FileNotFoundError:
        raise Finger3dError(f"{path}: there is no such file") from None
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise Finger3dError(
            f"{path}: not a CSV file; it must have a line of names, then one line for each reading"
        ) from None
    columns = job.columns_of(path, [str(name) for name in rows[0]] if rows else [])
    values = {
        name: [_number(path, i, column, row) for i, row in enumerate(rows, start=2)] for name, column in columns.items()
    }
    stds: dict[str, list[float] | float] = {**job.given_stds}
    stds |= {name: values[f"{name}_std"] for name in job.names if f"{name}_std" in values}
    return {name: values[name] for name in job.names}, stds


def _number(path: Path | str, line: int, name: str, row: Mapping[str, str | None]) -> float:
    text = row.get(name) or ""
    try:
        return float(text)
    except ValueError:
        raise Finger3dError(f"{path}: line {line}: {name} = {text!r:.40}: must be a number") from None
