"""Command ``cost``: what accuracy costs for a scene."""

from __future__ import annotations

from pathlib import Path

from finger3d.cli.common import app, job, load
from finger3d.cli.options import Json, Set
from finger3d.cli.printing import print_columns, print_json
from finger3d.errors import Finger3dError

_MOST_NAMES = 6
"""Largest number of names that are listed."""


@app.command
def cost(
    scene: Path,
    /,
    *,
    of: str | None = None,
    png: Path | None = None,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Forecast edge lengths, time and memory for errors of 10, 3, 1 and 0.3 %, from two coarse presses.

    Example: finger3d cost scene.toml --of stick_area_mm2,gauge_g36 --png cost.png

    Parameters
    ----------
    scene
        The scene file (TOML).
    of
        Numbers whose errors are meant, separated by commas, or all; default: the normal force.
    png
        Draw the errors against the time.
    """
    if png is not None and png.suffix.lower() != ".png":
        raise Finger3dError(f"--png {png}: the name must end in .png")
    loaded = load(scene, set_)
    from finger3d.analyses.cost import cost as run

    with job(json_, lambda done: "a forecast keeps nothing") as report:
        found = run(loaded, [name.strip() for name in of.split(",")] if of else [], png, report)
    if json_:
        print_json(found.as_dict())
        return
    head, *lines = found.table()
    print_columns(head, lines)
    chosen_for = ", ".join(found.of) if len(found.of) <= _MOST_NAMES else f"all {len(found.of)} numbers"
    print(f"meshes are chosen for the errors of {chosen_for}; expected errors of mesh and increments")
    for row in found.rows:
        if row.limit:
            print(f"{100 * (row.error or 0.0):g} %: {row.limit}")
    print("to press on the mesh of a row, add:")
    for row in found.rows:
        if row.error is not None and row.dofs:
            print(f"  {100 * row.error:g} %: " + " ".join(f"--set {key}" for key in row.keys))
    if png is not None:
        print(f"{png} written")
