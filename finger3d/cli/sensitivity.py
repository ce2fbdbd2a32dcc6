"""Command ``sensitivity``: derivatives of the numbers of a press by the keys of its scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import Json, Set, app, check_writable, job, print_columns, print_json


@app.command
def sensitivity(
    scene: Path,
    /,
    *,
    of: Annotated[str, Parameter(help="Numbers of the press, separated by commas, such as gauge_g36,stick_area_mm2.")],
    out: Annotated[Path, Parameter(help="Folder for sensitivity.json, sensitivity.csv and sensitivity.png.")],
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Differentiate readings and other numbers at the end of a press by the keys of the scene.

    Example: finger3d sensitivity scene.toml --of gauge_g36,stick_area_mm2 --out out

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    from finger3d.analyses.sensitivity import sensitivity as run

    check_writable(out, scene)
    with job(json_, lambda _: "derivatives are written together at the end") as report:
        found = run(scene, [name.strip() for name in of.split(",")], out, report, set_ or ())
    if json_:
        print_json(found.as_dict())
        return
    rows = found.rows()
    head = [name for name in rows[0] if found.falling or name != "derivative_falling"]
    print_columns(head, [[_text(row[name]) for name in head] for row in rows])
    print("change: standard deviation of the key in a careful set-up where one is known, else 1 % of its value")
    if found.falling:
        print("the press ends at a kink, so that some derivatives differ as the key grows and as it falls")
    if found.without:
        print(f"keys without a derivative, since they change mesh, object or symmetry: {', '.join(found.without)}")
    if found.held_normals:
        print(
            f"approximate: normals of {found.held_normals} contact points are held fixed at an edge of the object; "
            "a smaller mesh.size_mm resolves it"
        )
    print(f"results: {out}")


def _text(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
