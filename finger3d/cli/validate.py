"""Command ``validate``: the studies of validation/."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import Json, app, check_folder, job, print_columns, print_json, print_rows
from finger3d.errors import MissingError


@app.command
def validate(
    studies: Annotated[list[str] | None, Parameter(negative=())] = None,
    /,
    *,
    quick: Annotated[bool, Parameter(negative=())] = False,
    list_: Annotated[bool, Parameter(name="--list", negative=())] = False,
    out: Annotated[Path | None, Parameter(help="Folder for the results instead of validation/.")] = None,
    json_: Json = False,
) -> None:
    """Run the studies of validation/, which compare with closed forms, other codes and measurements.

    Without names, all studies with outdated results run. Studies that measure time (cost_of_accuracy, scaling,
    beside_calculix) run in full only if they are named.

    Example: finger3d validate press_line --quick

    Parameters
    ----------
    studies
        Names of studies.
    quick
        Use small meshes and few steps; the committed results do not change.
    list_
        Print the names of the studies and their questions, and run none.
    """
    from finger3d.analyses import validate as study
    from finger3d.analyses.study_rows import table

    known = study.studies()
    if list_:
        print_rows("studies", [(name, one.question) for name, one in known.items()])
        return
    selected = study.chosen(studies or [], known, quick)
    folder = study.results_folder(known, quick, out)
    check_folder(folder)
    with job(json_, lambda done: f"{done.steps_done} of {len(selected)} studies are kept in {folder}") as report:
        found = study.run_studies(selected, quick, folder, report, not studies and not quick, known)
    if json_:
        rows = {
            name: [{**asdict(row), "error": row.error, "passed": row.passed} for row in rows]
            for name, rows in found.items()
        }
        print_json({"results": folder, "studies": rows})
    else:
        print_columns("study what kind reference wanted got error tolerance verdict".split(), table(found))
        print(f"results: {folder}")
    failed = [name for name, rows in found.items() if not all(row.passed for row in rows)]
    if failed:
        raise MissingError(f"validate: outside the tolerance: {', '.join(failed)} (see the rows marked FAIL)")
