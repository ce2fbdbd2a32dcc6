"""estimate: the friction coefficient from strains."""

from __future__ import annotations

import csv
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from finger3d.cli.common import Json, app, print_json
from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from finger3d.sensor import Estimate


@app.command
def estimate(
    calibration: Path,
    /,
    *,
    strain: Annotated[float | None, Parameter(help="One strain reading.")] = None,
    std: Annotated[float | None, Parameter(help="Its standard deviation; default the calibration's noise.")] = None,
    csv_: Annotated[
        Path | None, Parameter(name="--csv", help="Many readings: a column strain, and std if it is there.")
    ] = None,
    out: Annotated[Path | None, Parameter(help="CSV file for the answers to --csv; else they are printed.")] = None,
    json_: Json = False,
    curve: Annotated[
        Literal["interpolation", "fit"], Parameter(help="Invert the monotone interpolation or the second-order fit.")
    ] = "interpolation",
    tolerances: Annotated[
        bool, Parameter(negative="--no-tolerances", help="Whether what the calibration does not know exactly counts.")
    ] = True,
) -> None:
    """Mu with its standard deviation from a strain reading, or why the strain does not tell it.

    Example: finger3d estimate cal/calibration.json --strain 0.052

    Parameters
    ----------
    calibration
        The calibration.json of `finger3d calibrate`.
    """
    from finger3d.sensor import estimate as run
    from finger3d.sensor import load as read

    if (strain is None) == (csv_ is None):
        raise Finger3dError("estimate: give either --strain NUMBER or --csv FILE")
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

        write_csv(out, {name: [_line(e)[i] for e in found] for i, name in enumerate(_COLUMNS)})
        told = sum(e.status in ("ok", "coarse") for e in found)
        print(f"{told} of {len(found)} readings tell mu; results: {out}")


_COLUMNS = ("strain", "reading_std", "mu", "std", "low", "high", "status", "verdict")


def _line(found: Estimate) -> list[Any]:
    return [getattr(found, name) for name in _COLUMNS]


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return repr(value)
    return f'"{value}"' if "," in value else str(value)


def _readings(path: Path, std: float | None) -> tuple[list[float], list[float] | float | None]:
    """Strains and their standard deviations from a CSV file."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.DictReader(stream))
    except FileNotFoundError:
        raise Finger3dError(f"{path}: there is no such file") from None
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise Finger3dError(f"{path}: not a CSV file; a line of names, then a reading a line") from None
    if not rows or "strain" not in rows[0]:
        names = ", ".join(str(k) for k in rows[0]) if rows else "nothing"
        raise Finger3dError(f"{path}: must have a column named strain and at least one reading; it has {names}")
    strains = [_number(path, i, "strain", row) for i, row in enumerate(rows, start=2)]
    if "std" not in rows[0]:
        return strains, std
    return strains, [_number(path, i, "std", row) for i, row in enumerate(rows, start=2)]


def _number(path: Path, line: int, name: str, row: dict[str, Any]) -> float:
    try:
        return float(row[name])
    except (TypeError, ValueError):
        raise Finger3dError(f"{path}: line {line}: {name} = {row[name]!r}: must be a number") from None
