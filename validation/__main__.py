"""Runs the studies beside this file: ``python -m validation [STUDY ...] [--quick]``, from a checkout."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from finger3d import cli
from finger3d.cli.common import job
from finger3d.cli.options import Json
from finger3d.cli.printing import print_columns, print_json
from finger3d.errors import MissingError
from finger3d.io import check_folder

from . import _runner
from ._rows import settled, table

app = App(name="python -m validation", suppress_keyboard_interrupt=False, result_action="return_value")


@app.default
def validate(
    studies: Annotated[list[str] | None, Parameter(negative=())] = None,
    /,
    *,
    quick: Annotated[bool, Parameter(negative=())] = False,
    out: Annotated[Path | None, Parameter(help="Folder for the results instead of validation/.")] = None,
    list_: Annotated[bool, Parameter(name="--list", negative=(), help="Only name the studies.")] = False,
    json_: Json = False,
) -> None:
    """Run the studies, which compare with closed forms, other codes and measurements.

    Without names, all studies with outdated results run. Studies that measure time (cost_of_accuracy, scaling,
    beside_calculix) run in full only if they are named.

    Example: python -m validation press_with_friction --quick

    Parameters
    ----------
    studies
        Names of studies.
    quick
        Use small meshes and few steps; the committed results do not change.
    """
    known = _runner.studies()
    if list_:
        print_columns(["study", "question"], ([name, study.question] for name, study in known.items()))
        return
    selected = _runner.chosen(studies or [], known, quick)
    folder = _runner.results_folder(known, quick, out)
    check_folder(folder)
    with job(json_, lambda done: f"{done.steps_done} of {len(selected)} studies are kept in {folder}") as report:
        found = _runner.run_studies(selected, quick, folder, report, not studies and not quick, known)
    if json_:
        rows = {
            name: [{**asdict(row), "error": row.error, "passed": row.passed} for row in rows]
            for name, rows in found.items()
        }
        print_json({"results": folder, "studies": rows})
    else:
        print_columns("study what kind reference wanted got error tolerance verdict".split(), table(found))
        print(f"results: {folder}")
        if counts := [counts for study in selected if (counts := _runner.kept_settled(folder, study))]:
            print(settled(counts))
    failed = [name for name, rows in found.items() if not all(row.passed for row in rows)]
    if failed:
        raise MissingError(f"outside the tolerance: {', '.join(failed)} (see the rows marked FAIL)")


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code, as those of finger3d."""
    return cli.main(arguments, app)


if __name__ == "__main__":
    sys.exit(main())
