"""Command ``estimate``: the friction coefficient from readings."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import app
from finger3d.cli.options import Json, ReadingOptions
from finger3d.cli.printing import print_json
from finger3d.errors import Finger3dError


@app.command
def estimate(
    calibration: Path,
    /,
    *,
    given: Annotated[ReadingOptions | None, Parameter(name="*")] = None,
    out: Path | None = None,
    json_: Json = False,
    tolerances: bool = True,
) -> None:
    """Estimate mu and its standard deviation from readings, or report why they do not determine mu.

    Example: finger3d estimate cal/calibration.json --strain 0.052

    With --follow an estimate is printed as soon as its reading is written, until standard input ends or Ctrl-C. A line
    that is no reading has the status invalid and the reason; a file that is replaced or cut is read from its start.

    Parameters
    ----------
    calibration
        The calibration.json that `finger3d calibrate` wrote.
    out
        CSV file for the estimates from --csv; default: print them.
    tolerances
        Include the tolerances of the calibration in the standard deviation.
    """
    given = given or ReadingOptions()
    if sum(source is not None for source in (given.strain, given.csv, given.follow)) != 1:
        raise Finger3dError("estimate: give either --strain NUMBER, --csv FILE or --follow FILE")
    if out is not None and given.csv is None:
        raise Finger3dError("estimate: --out goes with --csv")
    from finger3d.io import write_csv
    from finger3d.sensor import load
    from finger3d.sensor.given_readings import Estimator, csv_line, named_numbers

    read = load(calibration)
    estimator = Estimator(read, named_numbers(read, "--std", given.std or (), plain_for_all=True), tolerances)
    if given.follow is not None:
        for line in estimator.followed(given.follow):
            print(line, flush=True)
    elif given.csv is None:
        (result,) = estimator.estimates(named_numbers(read, "--strain", given.strain or ()), {})
        if json_:
            print_json(asdict(result))
        else:
            print(result.verdict)
    else:
        found = estimator.of_file(given.csv)
        rows = [estimator.cells(one) for one in found]
        if json_:
            print_json([asdict(one) for one in found])
        elif out is None:
            print("\n".join(map(csv_line, [estimator.columns, *rows])))
        else:
            write_csv(out, {name: [row[i] for row in rows] for i, name in enumerate(estimator.columns)})
            determined = sum(one.is_determined for one in found)
            print(f"{determined} of {len(found)} readings determine mu; results: {out}")
