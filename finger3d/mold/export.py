"""Export of a scene's finger as STEP and STL, and of a printable mold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._extras import require
from finger3d.errors import Finger3dError
from finger3d.geometry.imported import Imported
from finger3d.geometry.surface import Triangles
from finger3d.io import claimed, holds
from finger3d.materials.silicones import silicone_named
from finger3d.mold.options import MoldOptions
from finger3d.progress import Progress
from finger3d.scene import Source, scene_of

if TYPE_CHECKING:
    from build123d import Solid

    from finger3d.geometry.design import Design
    from finger3d.mold.body import Shell
    from finger3d.mold.parts import Mold
    from finger3d.scene import Scene


_TOLERANCE_MM = 0.05  # without a mold
_LEAST_TOLERANCE_MM = 1e-4
_LARGEST_TOLERANCE = 0.2  # of the finger's height


@dataclass(frozen=True)
class Exported:
    """Files and volumes of an export.

    Attributes
    ----------
    files : paths of the files in `out`
    volume_mm3 : of the finger, by its closed form or by CAD
    stl_volume_mm3 : inside the triangles of finger.stl
    tolerance_mm : largest distance of these triangles from the finger; for a body of triangles that of the file, 0
    silicone_ml : volume of silicone in the cavity; None without a mold
    remarks : remarks for the user, a line each
    """

    files: tuple[Path, ...]
    volume_mm3: float
    stl_volume_mm3: float
    tolerance_mm: float
    silicone_ml: float | None
    remarks: tuple[str, ...]

    @property
    def rows(self) -> list[tuple[str, str]]:
        """The volumes in words."""
        off = self.stl_volume_mm3 / self.volume_mm3 - 1.0
        rows = [("volume", f"{self.volume_mm3:.6g} mm3; finger.stl differs by {off:+.1e}")]
        rows.append(("tolerance", f"{self.tolerance_mm:.3g} mm"))
        if self.silicone_ml is not None:
            rows.append(("silicone", f"{self.silicone_ml:.3g} ml in the cavity; see sheet.txt"))
        return rows


def export(
    scene: Source,
    out: str | Path,
    mold: MoldOptions | None = None,
    tolerance_mm: float | None = None,
    report: Progress | None = None,
    overrides: Sequence[str] = (),
) -> Exported:
    """Write the finger as STEP and STL and, if asked, the printable parts of a mold; all in mm.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    out : folder for finger.step and finger.stl, and for the parts, sheet and pictures of a mold
    mold : `finger3d.MoldOptions`; None: no mold
    tolerance_mm : largest distance of the triangles from the CAD surface, smaller where the volume asks for it; None:
        0.05 mm, or with a mold the printer's
    report : told about stages
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Raises
    ------
    Finger3dError
        If the tolerance makes no sense, the folder refuses, or the mold cannot be made (see `finger3d.mold.parts`).

    Examples
    --------
    >>> import tempfile, finger3d
    >>> scene = {
    ...     "finger": {"geometry": "block", "half_length_mm": 10.0, "height_mm": 8.0, "width_mm": 6.0},
    ...     "material": {"E_MPa": 1.0, "nu": 0.4}, "press": {"depth_mm": 1.0},
    ... }
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = finger3d.export(scene, folder)
    >>> [file.name for file in done.files], round(done.stl_volume_mm3, 6)
    (['finger.step', 'finger.stl'], 960.0)
    """
    from finger3d.mold.body import Shell, shell, write_step, write_stl
    from finger3d.mold.output import write_mold

    out, report, scene = Path(out), report or Progress(), scene_of(scene, overrides)
    design = scene.design
    triangles = design.surface if isinstance(design, Imported) and design.cad is None else None
    if tolerance_mm is None:
        tolerance_mm = _TOLERANCE_MM if mold is None else mold.machine.tolerance_mm
        tolerance_mm = min(tolerance_mm, _LARGEST_TOLERANCE * design.height_mm)
    _check(design, out, tolerance_mm, needs_cad=triangles is None or mold is not None)
    report.stage("finger")
    if triangles is not None:
        body, solid = Shell(triangles, 0.0, 0.0), None
    else:
        solid = design.solid()
        body = shell(solid, tolerance_mm, design.name)
    assembly = None
    if mold is not None:
        report.stage("mold")
        assembly = _mold(scene, triangles if solid is None else solid, mold)
    with claimed(out):
        _clear(out)
        files, remarks = [], []
        if solid is None:
            remarks.append(f"no finger.step: {design.name} holds triangles, no CAD; they are written as they are")
        else:
            write_step(out / "finger.step", solid)
            files.append(out / "finger.step")
        write_stl(out / "finger.stl", body.surface)
        files.append(out / "finger.stl")
        silicone = None
        if assembly is not None:
            name = scene.tables.material.silicone
            named = silicone_named(name) if name else None
            written, told = write_mold(scene.title, assembly, body, out, report, named)
            files += written
            remarks += told
            silicone = assembly.silicone_mm3 / 1e3
    return Exported(
        tuple(files), _volume(design, solid, body), body.surface.volume, body.tolerance_mm, silicone, tuple(remarks)
    )


def _check(design: Design, out: Path, tolerance_mm: float, needs_cad: bool) -> None:
    """Refuse an export without CAD, a tolerance out of range, and a folder that holds the finger's own file."""
    if needs_cad:
        require("export", "build123d")
    largest = _LARGEST_TOLERANCE * design.height_mm
    if not _LEAST_TOLERANCE_MM <= tolerance_mm <= largest:
        raise Finger3dError(
            f"--tolerance-mm {tolerance_mm}: must be from {_LEAST_TOLERANCE_MM:g} to {largest:.4g}, "
            "a fifth of the finger's height"
        )
    if isinstance(design, Imported) and holds(out, ("finger.step", "finger.stl"), design.path):
        raise Finger3dError(f"--out {out}: holds {Path(design.path).name}, the finger's own file; name another folder")


def _clear(out: Path) -> None:
    """Remove the files of an earlier export, which may be of another finger."""
    from finger3d.mold.output import FILES

    for name in ("finger.step", "finger.stl"):
        (out / name).unlink(missing_ok=True)
    for pattern in FILES:
        for path in out.glob(pattern):
            path.unlink()


def _mold(scene: Scene, shape: Solid | Triangles, options: MoldOptions) -> Mold:
    from finger3d.mold.cover import SECTION_MM, foils
    from finger3d.mold.parts import mold

    embedded = scene.effects.get("embedded_gauge")
    section = (embedded.thickness_mm, embedded.width_mm) if embedded else SECTION_MM
    slots = foils(scene.model().gauges, section)
    rigid = [label for label, part in scene.tables.parts.items() if part.rigid]
    if not options.parts and not rigid:
        return mold(shape, slots, options)
    if isinstance(shape, Triangles):
        what = "--parts" if options.parts else f"[parts.{rigid[0]}] rigid = true"
        raise Finger3dError(f"{what}: {scene.design.name} holds triangles; only CAD files keep their solids")
    return mold(shape, slots, options, scene.design.solids(), rigid)


def _volume(design: Design, solid: Solid | None, body: Shell) -> float:
    """Return the finger's volume (mm3): in closed form, by CAD, or of its triangles."""
    from finger3d.mold.body import volume

    if not isinstance(design, Imported):
        return float(design.volume_mm3)
    return body.surface.volume if solid is None else volume(solid)
