"""Command ``sensitivity``: what a change of each key of the scene does to the numbers of its press."""

from __future__ import annotations

from pathlib import Path

from finger3d.cli.common import app, job
from finger3d.cli.options import Json, Set, Texts, parsed_tolerances
from finger3d.cli.printing import print_columns, print_json


@app.command
def sensitivity(
    scene: Path,
    /,
    *,
    of: str,
    out: Path,
    tolerance: Texts | None = None,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Change every key of the scene by its tolerance, to both sides, and tell what this does to readings and forces.

    Example: finger3d sensitivity scene.toml --of gauge_g36,stick_area_mm2 --out out

    Parameters
    ----------
    scene
        The scene file (TOML).
    of
        Numbers of the press, separated by commas, such as gauge_g36,stick_area_mm2.
    out
        Folder for sensitivity.json, sensitivity.csv and sensitivity.png.
    tolerance
        Change of a key, for instance friction.mu=0.02; may be repeated. Unless given, that of a careful set-up
        where one is known, else 1 % of the value.
    """
    from finger3d.analyses.sensitivity import sensitivity as run
    from finger3d.io import check_writable

    check_writable(out, scene)
    with job(json_, lambda _: "effects are written together at the end") as report:
        names = [name.strip() for name in of.split(",")]
        found = run(scene, names, out, report, set_ or (), parsed_tolerances(tolerance))
    if json_:
        print_json(found.as_dict())
        return
    lines = []
    for row in found.rows():
        effects = (_effect(row[way], row[f"{way}_error"]) for way in ("falling", "growing"))
        lines.append([row["number"], row["key"], f"{row['value']:.5g}", f"{row['change']:.3g}", *effects])
    print_columns(["number", "key", "value", "change", "as it falls", "as it grows"], lines)
    for key, reason in found.failures.items():
        print(f"{key}: {reason}")
    print(f"results: {out}")


def _effect(value: float, error: float) -> str:
    from finger3d.accuracy.error_bars import with_error

    return "" if value != value else with_error(value, error, sign="+-")
