"""Command ``export``: files for CAD, 3D printing and casting."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from finger3d.cli.common import Flag, Json, Set, app, check_folder, job, load, print_json, print_rows
from finger3d.errors import Finger3dError
from finger3d.mold.options import MoldOptions

if TYPE_CHECKING:
    from finger3d.analyses.export_model import ModelFiles
    from finger3d.mold.export import Exported

_INSERT = "draw it as a part of the design with [parts.LABEL] rigid = true: it is printed and inserted"
_PLAIN = "the faces are plain: hold them with --screw, clamps or rubber bands"

GONE = {
    **dict.fromkeys(("--carrier", "--carrier-mm", "--key-mm", "--inserts"), _INSERT),
    **dict.fromkeys(("--fasten", "--band-mm", "--seal", "--cord-mm", "--pry", "--no-pry"), _PLAIN),
    **dict.fromkeys(("--plugs", "--no-plugs", "--slot-gap-mm"), "slots of strips are sealed with tape"),
    "--ascii": "STL files are binary; a program that reads them turns them into text",
    "--wall-mm": "the walls are 8 mm thick",
    "--peg-mm": "pegs have a diameter of 4 mm",
    "--lid-mm": "the lid is 4 mm thick",
    "--vent-mm": "vents are as wide as the base allows, at most 2 mm",
    "--foil-length-mm": "give length_mm in [[gauge]]; without it a foil is 5 mm long",
    **dict.fromkeys(
        ("--foil-thickness-mm", "--foil-width-mm"),
        "give them in [effects.embedded_gauge]; without it they are 0.1 and 3 mm",
    ),
    "--riser": "the pour hole is a funnel, of the width --pour-mm at the sensor",
    "--cavities": "print the mold several times",
    "--coupon": "give the clearance of your printer as --clearance-mm",
    "--button": "press a sample with a scene of its own, and finger3d identify",
    "--bed": "the program of the printer arranges the parts",
}
"""Options that are gone, and what to do instead."""


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """What is written.

    Parameters
    ----------
    mold
        Also write a printable mold.
    tolerance_mm
        Largest distance between triangles and surface, in mm; 0.05, or with --mold the printer's.
    mesh
        Write the mesh as .vtu instead, with its facets and parts by name.
    solver
        Write the press as an input deck of this solver instead: calculix.
    """

    mold: Flag = False
    tolerance_mm: float | None = None
    mesh: Flag = False
    solver: Literal["calculix"] | None = None


@app.command
def export(
    scene: Path,
    /,
    *,
    out: Path,
    what: Annotated[ExportOptions, Parameter(name="*")] = ExportOptions(),
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
    out
        Folder for the files.
    """
    chosen = options or MoldOptions()
    if not what.mold and chosen != MoldOptions():
        raise Finger3dError("export: options of a mold need --mold")
    if what.mold + what.mesh + bool(what.solver) > 1:
        raise Finger3dError("export: --mold, --mesh and --solver write different things; give one of them")
    loaded = load(scene, set_)
    check_folder(out)
    done: Exported | ModelFiles
    with job(json_, lambda _: f"the files in {out} are complete") as report:
        if what.mesh or what.solver:
            from finger3d.analyses.export_model import export_deck, export_mesh

            model = (export_deck if what.solver else export_mesh)(loaded, out, report)
            done, rows = model, _rows_of_model(model)
        else:
            from finger3d.mold.export import export as run

            finger = run(loaded, out, chosen if what.mold else None, what.tolerance_mm, report)
            done, rows = finger, _rows_of_finger(finger)
    if json_:
        print_json({"results": out, **asdict(done)})
        return
    print_rows(loaded.title, [*rows, ("results", str(out)), *(("", file.name) for file in done.files)])
    for text in done.remarks:
        print(f"remark: {text}")


def _rows_of_finger(done: Exported) -> list[tuple[str, str]]:
    off = done.stl_volume_mm3 / done.volume_mm3 - 1.0
    rows = [
        ("volume", f"{done.volume_mm3:.6g} mm3; finger.stl differs by {off:+.1e}"),
        ("tolerance", f"{done.tolerance_mm:.3g} mm"),
    ]
    if done.silicone_ml is not None:
        rows.append(("silicone", f"{done.silicone_ml:.3g} ml in the cavity; see sheet.txt"))
    return rows


def _rows_of_model(done: ModelFiles) -> list[tuple[str, str]]:
    rows = [("mesh", f"{done.cells} cells, {done.points} points")]
    if done.multiple is not None:
        rows.append(("force", f"{done.multiple:.12g} times the total force that ccx prints"))
    return rows
