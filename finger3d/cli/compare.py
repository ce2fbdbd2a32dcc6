"""Command ``compare``: a scene in plane stress, in plane strain and as a solid."""

from __future__ import annotations

from pathlib import Path

from finger3d.cli.common import app, job, load
from finger3d.cli.options import Json, Out, Set
from finger3d.cli.printing import print_columns, print_json
from finger3d.errors import Finger3dError, MissingError


@app.command
def compare(
    scene: Path,
    /,
    *,
    out: Out,
    widths: str | None = None,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Solve a scene in plane stress, in plane strain and as a solid, and judge whether a 2D model is sufficient.

    Example: finger3d compare scene.toml --out out --widths 5,20,50,200

    Parameters
    ----------
    scene
        The scene file (TOML).
    widths
        Widths in mm beside that of the scene, separated by commas; default 1, 4, 12 and 24 finger heights. The width of
        the scene alone, given here, takes the least time.
    """
    try:
        chosen = None if widths is None else [float(part) for part in widths.split(",")]
    except ValueError:
        raise Finger3dError(f"--widths {widths}: must be numbers of mm with commas, for instance 5,20,50,200") from None
    loaded = load(scene, set_, out)
    from finger3d.analyses.compare import compare as run
    from finger3d.results.summary import read_json

    with job(json_, lambda done: f"{done.steps_done} of {done.steps_total} cases are kept in {out}") as report:
        result = run(loaded, out, chosen, report)
    if json_:
        print_json(read_json(out / "compare.json"))
    else:
        if result.table:
            print_columns(result.table[0], result.table[1:])
        print("\n".join(result.verdict))
        print(f"results: {out}")
    if not result.outcome.ok:
        failed = sum(not case.ok for case in result.cases)
        raise MissingError(f"{scene}: {failed} of {len(result.cases)} cases gave no numbers: {result.outcome}")
