"""compare: a scene as plane stress, plane strain and solid."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import Json, Set, app, check_writable, complain, load, print_json, reporting
from finger3d.errors import Finger3dError, MissingError


@app.command
def compare(
    scene: Path,
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder for the results.")],
    widths: Annotated[
        str | None, Parameter(help="Further widths in mm, separated by commas; default 1, 4, 12 and 24 finger heights.")
    ] = None,
    set_: Set = None,
    json_: Json = False,
) -> int:
    """Solve a scene as plane stress, plane strain and solid: would 2D have done, and by how much not?

    Example: finger3d compare scene.toml --out out --widths 5,20,50,200

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    chosen = None if widths is None else [_width(text) for text in widths.split(",")]
    loaded = load(scene, set_)
    if loaded.tables.mesh.tolerance is not None:
        raise Finger3dError(
            f"{scene}: mesh.tolerance = {loaded.tables.mesh.tolerance:g}: compare solves on equal sizes; press finds "
            "them and writes them to its scene.toml, take that one"
        )
    check_writable(out, scene)
    from finger3d.analyses.compare.run import compare as run

    report, aside = reporting(json_)
    try:
        with aside, report:
            result = run(loaded, out, chosen, report)
    except KeyboardInterrupt:
        complain(f"interrupted; {report.steps_done} of {report.steps_total} cases are kept in {out}")
        return 130
    if json_:
        print_json(json.loads((out / "compare.json").read_text(encoding="utf-8")))
    else:
        print("\n".join(result.verdict))
        print(f"results: {out}")
    if result.outcome.ok:
        return 0
    failed = sum(not case.ok for case in result.cases)
    complain(f"{scene}: {failed} of {len(result.cases)} cases gave no numbers: {result.outcome}")
    return MissingError.exit_code


def _width(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise Finger3dError(f"--widths: {text.strip()!r} is no number; give mm and commas: 5,20,50,200") from None
