"""Command ``export``: files for CAD, 3D printing and casting."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from finger3d.cli.common import Json, Set, app, check_folder, job, load, print_json, print_rows
from finger3d.errors import Finger3dError
from finger3d.mold.options import MoldOptions

if TYPE_CHECKING:
    from finger3d.analyses.export_model import ModelFiles
    from finger3d.mold.export import Exported
    from finger3d.scene import Scene

_INSERT = "draw it as a part of the design with [parts.LABEL] rigid = true: it is printed and inserted"
_PLAIN = "the faces are plain: hold them with --screw, clamps or rubber bands"

GONE = {
    **dict.fromkeys(("--carrier", "--carrier-mm", "--key-mm", "--inserts"), _INSERT),
    **dict.fromkeys(("--fasten", "--band-mm", "--seal", "--cord-mm", "--pry", "--no-pry"), _PLAIN),
    **dict.fromkeys(("--plugs", "--no-plugs", "--slot-gap-mm"), "slots of strips are sealed with tape"),
    "--riser": "the pour hole is a funnel, of the width --pour-mm at the sensor",
    "--cavities": "print the mold several times",
    "--coupon": "give the clearance of your printer as --clearance-mm",
    "--button": "press a sample with a scene of its own, and finger3d identify",
    "--bed": "the program of the printer arranges the parts",
}
"""Options that are gone, and what to do instead."""


@app.command
def export(
    scene: Path,
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder for the files.")],
    mold: Annotated[bool, Parameter(negative=(), help="Also write a printable mold.")] = False,
    ascii_: Annotated[
        bool, Parameter(name="--ascii", negative=(), help="Write STL files as text instead of binary.")
    ] = False,
    tolerance_mm: Annotated[
        float | None,
        Parameter(help="Largest distance between triangles and surface, in mm; 0.05, or with --mold the printer's."),
    ] = None,
    mesh: Annotated[
        bool, Parameter(negative=(), help="Write the mesh as .vtu and .msh instead, with its facets and parts by name.")
    ] = False,
    solver: Annotated[
        Literal["calculix"] | None, Parameter(help="Write the press as an input deck of this solver instead: calculix.")
    ] = None,
    options: Annotated[MoldOptions | None, Parameter(name="*", group="Mold (with --mold)")] = None,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Write the finger as STEP and STL, and with --mold also the parts of a mold, instructions and pictures.

    Example: finger3d export scene.toml --out print --mold --shrinkage 0.001 --screw M4

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    chosen = options or MoldOptions()
    if not mold and chosen != MoldOptions():
        raise Finger3dError("export: options of a mold need --mold")
    if mold + mesh + bool(solver) > 1:
        raise Finger3dError("export: --mold, --mesh and --solver write different things; give one of them")
    loaded = load(scene, set_)
    check_folder(out)
    if mesh or solver:
        _export_model(loaded, out, solver is not None, json_)
        return
    from finger3d.mold.export import export as run

    with job(json_, lambda _: f"the files in {out} are complete") as report:
        done = run(loaded, out, chosen if mold else None, ascii_, tolerance_mm, report)
    if json_:
        print_json({"results": out, **asdict(done)})
        return
    off = done.stl_volume_mm3 / done.volume_mm3 - 1.0
    rows = [
        ("volume", f"{done.volume_mm3:.6g} mm3; finger.stl differs by {off:+.1e}"),
        ("tolerance", f"{done.tolerance_mm:.3g} mm"),
    ]
    if done.silicone_ml is not None:
        rows.append(("silicone", f"{done.silicone_ml:.3g} ml in the cavity; see sheet.txt"))
    _print(loaded.title, rows, out, done)


def _print(title: str, rows: list[tuple[str, str]], out: Path, done: Exported | ModelFiles) -> None:
    """Print a table that ends with the files, and the remarks."""
    print_rows(title, [*rows, ("results", str(out)), *(("", file.name) for file in done.files)])
    for text in done.remarks:
        print(f"remark: {text}")


def _export_model(scene: Scene, out: Path, deck: bool, json_: bool) -> None:
    """Write the mesh, or the press as a deck."""
    from finger3d.analyses.export_model import export_deck, export_mesh

    with job(json_, lambda _: f"the files in {out} are complete") as report:
        done = export_deck(scene, out, report) if deck else export_mesh(scene, out, report)
    if json_:
        print_json({"results": out, **asdict(done)})
        return
    rows = [("mesh", f"{done.cells} cells, {done.points} points")]
    if done.multiple is not None:
        rows.append(("force", f"{done.multiple:.12g} times the total force that ccx prints"))
    _print(scene.title, rows, out, done)
