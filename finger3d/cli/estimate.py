"""Command ``estimate``: the friction coefficient from readings."""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from finger3d.cli.common import Json, app, print_json
from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from finger3d._types import Tree
    from finger3d.sensor import Calibration, Estimate, JointCalibration, JointEstimate

    AnyEstimate = Estimate | JointEstimate

_POLL_S = 0.02
"""Time between two looks at a file that is followed."""


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
            help="One strain reading; or NAME=READING, repeated for each of several calibrated readings.",
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
            help="CSV file of readings: a column strain and, optionally, a column std; of several calibrated readings "
            "a column for each, NAME, and optionally NAME_std.",
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
        Parameter(help="Curve of a single gauge to invert: the monotone interpolation or the second-order fit."),
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

    With --follow an estimate is printed as soon as its reading is written, until standard input ends or Ctrl-C.

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
    job = _Job(read(calibration), std or (), curve, tolerances)
    if strain is not None:
        (found,) = job.estimates(job.named("--strain", strain), job.stds)
        if json_:
            print_json(asdict(found))
        else:
            print(found.verdict)
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
        print("\n".join([",".join(job.columns), *(",".join(map(_cell, job.line(e))) for e in every)]))
    else:
        from finger3d.io import write_csv

        lines = [job.line(e) for e in every]
        columns: Tree = {name: [line[i] for line in lines] for i, name in enumerate(job.columns)}
        write_csv(out, columns)
        determined = sum(e.status in ("ok", "coarse") for e in every)
        print(f"{determined} of {len(every)} readings determine mu; results: {out}")


@dataclass(frozen=True)
class _Job:
    """A calibration and how readings are to be turned into mu; a single gauge is called ``strain``, as its column."""

    calibration: Calibration | JointCalibration
    given_stds: Sequence[str]
    curve: Literal["interpolation", "fit"]
    tolerances: bool

    @property
    def joint(self) -> bool:
        from finger3d.sensor import JointCalibration

        return isinstance(self.calibration, JointCalibration)

    @property
    def names(self) -> tuple[str, ...]:
        """Columns of the readings."""
        return self.calibration.names if self.joint else ("strain",)  # type: ignore[union-attr]

    @property
    def std_columns(self) -> tuple[str, ...]:
        return tuple(f"{name}_std" for name in self.names) if self.joint else ("std",)

    @property
    def stds(self) -> dict[str, float]:
        """Standard deviations of ``--std`` by name."""
        return self.named("--std", self.given_stds, plain_for_all=True)

    def named(self, option: str, texts: Sequence[str], plain_for_all: bool = False) -> dict[str, float]:
        """Return the numbers of an option by name: of ``NAME=NUMBER``, or of the plain number for a single gauge."""
        found: dict[str, float] = {}
        for text in texts:
            name, equals, value = text.rpartition("=")
            try:
                number = float(value)
            except ValueError:
                raise Finger3dError(f"{option} {text}: must be a number, or NAME=NUMBER") from None
            for one in self._meant(option, text, name.strip() if equals else "", plain_for_all):
                if one in found:
                    raise Finger3dError(f"{option} {text}: {one} is given twice")
                found[one] = number
        return found

    def _meant(self, option: str, text: str, name: str, plain_for_all: bool) -> tuple[str, ...]:
        """Return the columns that a name stands for."""
        if not self.joint:
            own = self.calibration.name  # type: ignore[union-attr]
            if name not in ("", own):
                raise Finger3dError(f"{option} {text}: {name} is not calibrated; the gauge is {own}")
            return ("strain",)
        if name in self.names:
            return (name,)
        if name:
            raise Finger3dError(f"{option} {text}: {name} is not calibrated; the readings are {', '.join(self.names)}")
        if plain_for_all and len({c.kind for c in self.calibration.readings}) == 1:  # type: ignore[union-attr]
            return self.names
        raise Finger3dError(
            f"{option} {text}: {', '.join(self.names)} are calibrated; give the name of the reading, for instance "
            f"{option} {self.names[0]}={text}"
        )

    def estimates(
        self, values: Mapping[str, Sequence[float] | float], stds: Mapping[str, Sequence[float] | float]
    ) -> Sequence[AnyEstimate]:
        """Return an estimate for each reading, or set of readings."""
        from finger3d.sensor import estimate as run

        if self.joint:
            return run(self.calibration, values, stds, self.curve, self.tolerances)
        return run(self.calibration, values["strain"], stds.get("strain"), self.curve, self.tolerances)

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the estimates."""
        if self.joint:
            return (*self.names, "mu", "std", "low", "high", "status", "chi_square", "p_value", "verdict")
        return ("strain", "reading_std", "mu", "std", "low", "high", "status", "verdict")

    def line(self, found: AnyEstimate) -> list[object]:
        """Return the cells of an estimate."""
        readings = found.readings if self.joint else {}  # type: ignore[union-attr]
        return [readings[name] if name in readings else getattr(found, name) for name in self.columns]


def _followed(job: _Job, source: str) -> Iterator[str]:
    """Yield a line of names, and a line for each reading as soon as it is written."""
    rows = csv.DictReader(_written_lines(source))
    yield ",".join(job.columns)
    for number, row in enumerate(rows, start=2):
        _check_columns(job, source, row)
        values = {name: _number(source, number, name, row) for name in job.names}
        stds = dict(job.stds)
        for name, column in zip(job.names, job.std_columns, strict=True):
            if column in row:
                stds[name] = _number(source, number, column, row)
        try:
            (found,) = job.estimates(values, stds)
        except Finger3dError as error:
            raise Finger3dError(f"{source}: line {number}: {error}") from None
        yield ",".join(map(_cell, job.line(found)))


def _written_lines(source: str) -> Iterator[str]:
    """Yield the lines of a file as they are written, without end; those of standard input until it ends."""
    if source == "-":
        yield from sys.stdin
        return
    try:
        stream = Path(source).open(encoding="utf-8-sig")
    except OSError as error:
        raise Finger3dError(f"{source}: cannot be read: {error.strerror}") from None
    with stream:
        begun = ""
        while True:
            begun += stream.readline()
            if begun.endswith("\n"):
                yield begun
                begun = ""
            else:
                time.sleep(_POLL_S)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return repr(value)
    text = str(value)
    return f'"{text}"' if "," in text else text


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
    _check_columns(job, path, rows[0] if rows else {})
    values = {name: [_number(path, i, name, row) for i, row in enumerate(rows, start=2)] for name in job.names}
    stds: dict[str, list[float] | float] = dict(job.stds)
    for name, column in zip(job.names, job.std_columns, strict=True):
        if column in rows[0]:
            stds[name] = [_number(path, i, column, row) for i, row in enumerate(rows, start=2)]
    return values, stds


def _check_columns(job: _Job, source: Path | str, row: Mapping[str, object]) -> None:
    """Raise an error for a file without one of the columns."""
    missing = [name for name in job.names if name not in row]
    if missing:
        raise Finger3dError(
            f"{source}: must have a column named {' and one named '.join(missing)} and at least one reading; it has "
            f"{', '.join(map(str, row)) or 'nothing'}"
        )


def _number(path: Path | str, line: int, name: str, row: Mapping[str, str | None]) -> float:
    try:
        return float(row[name] or "")
    except ValueError:
        raise Finger3dError(f"{path}: line {line}: {name} = {row[name]!r}: must be a number") from None
