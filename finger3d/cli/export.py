"""Command ``export``: files for CAD, 3D printing and casting."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from finger3d.cli.common import app, job, load
from finger3d.cli.options import Flag, Json, Set
from finger3d.cli.printing import print_json, print_rows
from finger3d.errors import Finger3dError
from finger3d.mold.options import MoldOptions

if TYPE_CHECKING:
    from finger3d.analyses.calculix import ModelFiles
    from finger3d.mold.export import Exported


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
    from finger3d.io import check_folder

    loaded = load(scene, set_)
    check_folder(out)
    done: Exported | ModelFiles
    with job(json_, lambda _: f"the files in {out} are complete") as report:
        if what.mesh or what.solver:
            from finger3d.analyses.calculix import export_deck, export_mesh

            done = (export_deck if what.solver else export_mesh)(loaded, out, report)
        else:
            from finger3d.mold.export import export as run

            done = run(loaded, out, chosen if what.mold else None, what.tolerance_mm, report)
    if json_:
        print_json({"results": out, **asdict(done)})
        return
    print_rows(loaded.title, [*done.rows, ("results", str(out)), *(("", file.name) for file in done.files)])
    for text in done.remarks:
        print(f"remark: {text}")
