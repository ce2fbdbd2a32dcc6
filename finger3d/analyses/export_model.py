"""Files of a scene's model for other programs: its mesh as .vtu, and the press as a deck of CalculiX."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from finger3d.errors import Finger3dError
from finger3d.io import claimed, holds, write_text
from finger3d.progress import Progress
from finger3d.scene import Source, scene_of

MESH_FILE = "finger.vtu"
DECK_FILE = "press.inp"


@dataclass(frozen=True)
class ModelFiles:
    """Files of a model.

    Attributes
    ----------
    files : paths of the files
    points, cells : of the mesh that was written
    multiple : forces on the whole finger over those that CalculiX prints; None without a deck
    remarks : remarks for the user, a line each
    """

    files: tuple[Path, ...]
    points: int
    cells: int
    multiple: float | None = None
    remarks: tuple[str, ...] = ()

    @property
    def rows(self) -> list[tuple[str, str]]:
        """The mesh and the factor of the forces in words."""
        rows = [("mesh", f"{self.cells} cells, {self.points} points")]
        if self.multiple is not None:
            rows.append(("force", f"{self.multiple:.12g} times the total force that ccx prints"))
        return rows


def export_mesh(
    scene: Source, out: str | Path, report: Progress | None = None, overrides: Sequence[str] = ()
) -> ModelFiles:
    """Write the mesh of the whole finger, its facets and its parts by name, as finger.vtu.

    It may be the finger of another scene.  Where symmetry halves the press, the mesh is unfolded.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    out : folder for the files
    report : told about stages
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Raises
    ------
    Finger3dError
        If the scene is a section, or the folder holds the finger's own file.
    """
    from finger3d.fem.mesh import axis_numbers, unfold
    from finger3d.mechanics.discretise.build import mesh_part
    from finger3d.mechanics.discretise.symmetry import symmetry
    from finger3d.meshing.mesh_files import write_mesh_vtu

    out, report, scene = Path(out), report or Progress(), scene_of(scene, overrides)
    model = scene.model()
    if model.domain != "solid":
        raise Finger3dError(f'--mesh: a section has no tetrahedra; set model.domain = "solid", not "{model.domain}"')
    own = Path(getattr(scene.design, "path", ""))
    if holds(out, (MESH_FILE,), own):
        raise Finger3dError(f"--out {out}: holds {own.name}, the finger's own file; name another folder")
    report.stage("meshing")
    axes = symmetry(model)
    part, _ = mesh_part(model, model.first_contact.contact_box, axes, report)
    whole, _, _ = unfold(part, axis_numbers(axes))
    with claimed(out):
        write_mesh_vtu(out / MESH_FILE, whole)
    return ModelFiles((out / MESH_FILE,), len(whole.points), len(whole.cells))


def export_deck(
    scene: Source, out: str | Path, report: Progress | None = None, overrides: Sequence[str] = ()
) -> ModelFiles:
    """Write press.inp, the same mesh, materials, object and path as an input deck of CalculiX.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    out : folder for the files
    report : told about stages
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Raises
    ------
    Finger3dError
        If CalculiX has no equal of what the scene asks for; the line names it.
    """
    from finger3d.analyses.calculix import press_deck
    from finger3d.analyses.effects_by_need import settled

    out, report = Path(out), report or Progress()
    scene, _ = settled(scene_of(scene, overrides), report)
    report.stage("meshing")
    made = press_deck(scene.model(), scene.title, report)
    report.stage("writing the deck")
    with claimed(out):
        write_text(out / DECK_FILE, made.deck.text())
    mesh = made.deck.mesh
    return ModelFiles((out / DECK_FILE,), len(mesh.points), len(mesh.cells), made.multiple, made.remarks)
