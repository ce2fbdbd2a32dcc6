"""Command ``estimate``: the friction coefficient from strain readings."""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from finger3d.cli.common import Json, app, print_json
from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from finger3d.sensor import Calibration, Estimate

_POLL_S = 0.02
"""Time between two looks at a file that is followed."""


@app.command
def estimate(
    calibration: Path,
    /,
    *,
    strain: Annotated[float | None, Parameter(help="One strain reading.")] = None,
    std: Annotated[
        float | None, Parameter(help="Standard deviation of the readings; default: the noise of the calibration.")
    ] = None,
    csv_: Annotated[
        Path | None,
        Parameter(name="--csv", help="CSV file of readings: a column strain and, optionally, a column std."),
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
        Parameter(help="Curve to invert: the monotone interpolation or the second-order fit."),
    ] = "interpolation",
    tolerances: Annotated[
        bool,
        Parameter(
            negative="--no-tolerances", help="Include the tolerances of the calibration in the standard deviation."
        ),
    ] = True,
) -> None:
    """Estimate mu and its standard deviation from strain readings, or report why a reading does not determine mu.

    Example: finger3d estimate cal/calibration.json --strain 0.052

    With --follow an estimate is printed as soon as its reading is written, until standard input ends or Ctrl-C.

    Parameters
    ----------
    calibration
        The calibration.json that `finger3d calibrate` wrote.
    """
    from finger3d.sensor import estimate as run
    from finger3d.sensor import load as read

    if sum(given is not None for given in (strain, csv_, follow)) != 1:
        raise Finger3dError("estimate: give either --strain NUMBER, --csv FILE or --follow FILE")
    if out is not None and csv_ is None:
        raise Finger3dError("estimate: --out goes with --csv")
    known = read(calibration)
    if strain is not None:
        found = run(known, strain, std, curve, tolerances)
        if json_:
            print_json(asdict(found[0]))
        else:
            print(found[0].verdict)
        return
    if follow is not None:
        for line in _followed(known, follow, std, curve, tolerances):
            print(line, flush=True)
        return
    assert csv_ is not None
    strains, stds = _readings(csv_, std)
    try:
        found = run(known, strains, stds, curve, tolerances)
    except Finger3dError as error:
        raise Finger3dError(f"{csv_}: {error}") from None
    if json_:
        print_json([asdict(e) for e in found])
    elif out is None:
        print("\n".join([",".join(_COLUMNS), *(",".join(map(_cell, _line(e))) for e in found)]))
    else:
        from finger3d.io import write_csv

        write_csv(out, {name: [getattr(e, name) for e in found] for name in _COLUMNS})
        determined = sum(e.status in ("ok", "coarse") for e in found)
        print(f"{determined} of {len(found)} readings determine mu; results: {out}")


def _followed(
    known: Calibration, source: str, std: float | None, curve: Literal["interpolation", "fit"], tolerances: bool
) -> Iterator[str]:
    """Yield a line of names, and a line for each reading as soon as it is written."""
    from finger3d.sensor import estimate as run

    rows = csv.DictReader(_written_lines(source))
    yield ",".join(_COLUMNS)
    for number, row in enumerate(rows, start=2):
        if "strain" not in row:
            raise Finger3dError(f"{source}: must have a column named strain; it has {', '.join(map(str, row))}")
        reading = _number(source, number, "strain", row)
        own = _number(source, number, "std", row) if "std" in row else std
        try:
            (found,) = run(known, reading, own, curve, tolerances)
        except Finger3dError as error:
            raise Finger3dError(f"{source}: line {number}: {error}") from None
        yield ",".join(map(_cell, _line(found)))


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


_COLUMNS = ("strain", "reading_std", "mu", "std", "low", "high", "status", "verdict")


def _line(found: Estimate) -> list[object]:
    return [getattr(found, name) for name in _COLUMNS]


def _cell(value: object) -> str:
    if isinstance(value, float):
        return repr(value)
    text = str(value)
    return f'"{text}"' if "," in text else text


def _readings(path: Path, std: float | None) -> tuple[list[float], list[float] | float | None]:
    """Read strains and their standard deviations from a CSV file; `std` if it has no column std."""
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
    if not rows or "strain" not in rows[0]:
        names = ", ".join(str(k) for k in rows[0]) if rows else "nothing"
        raise Finger3dError(f"{path}: must have a column named strain and at least one reading; it has {names}")
    strains = [_number(path, i, "strain", row) for i, row in enumerate(rows, start=2)]
    if "std" not in rows[0]:
        return strains, std
    return strains, [_number(path, i, "std", row) for i, row in enumerate(rows, start=2)]


def _number(path: Path | str, line: int, name: str, row: Mapping[str, str | None]) -> float:
    try:
        return float(row[name] or "")
    except ValueError:
        raise Finger3dError(f"{path}: line {line}: {name} = {row[name]!r}: must be a number") from None
