"""Files of a mold: parts as STL and 3MF, the assembly as STEP, instructions, a picture, and mold.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from finger3d.geometry.surface import Triangles
from finger3d.io import atomic
from finger3d.materials.silicones import Silicone
from finger3d.mold.body import ANGLE, Shell, write_3mf, write_step, write_stl
from finger3d.mold.foils import strips
from finger3d.mold.parts import HALVES, Mold
from finger3d.mold.pours import Pour, insert_name
from finger3d.mold.printing import as_printed, check_print, in_a_row
from finger3d.mold.sheet import close_lines, open_lines, pour_lines, prepare_lines, sheet, sizes
from finger3d.plotting.mold import StepPicture, kind, picture, separations, standing, step_pictures, taken_apart
from finger3d.progress import Progress
from finger3d.report.build import Code, Figure, HeadlineRow, PageSection, Table, write_page

PAGE = "mold.html"


@dataclass(frozen=True)
class CastingStep:
    """Step of casting: the word in its file's name, its title, its lines, and the parts of its picture."""

    word: str
    title: str
    lines: Sequence[str]
    parts: Mapping[str, Triangles]
    lying: bool = False


def mold_page(
    title: str,
    mold: Mold,
    shells: Mapping[str, Shell],
    printed: Mapping[str, Shell],
    out: Path,
    instructions: str,
    remarks: Sequence[str],
) -> list[Path]:
    """Write mold.html and the pictures of its steps; returns the files.

    Parameters
    ----------
    shells : parts in the assembled position
    printed : parts as they lie on the bed
    instructions : text of sheet.txt, repeated at the end
    remarks : warnings, shown at the top
    """
    steps = _steps(mold, shells, printed)
    pictures = [
        StepPicture(out / f"mold_step_{i}_{step.word}.png", step.parts, step.lying) for i, step in enumerate(steps, 1)
    ]
    step_pictures(pictures)
    sections = [
        PageSection(f"{i}. {step.title}", [*step.lines, Figure(picture.path.name, step.title)])
        for i, (step, picture) in enumerate(zip(steps, pictures, strict=True), 1)
    ]
    rows = [(name, sizes(part), f"mold_{name}.stl") for name, part in printed.items()]
    sections += [
        PageSection("Parts", [Table(("part", "size as printed, mm", "file"), rows)]),
        PageSection("Opening", _opening(mold)),
        PageSection("sheet.txt", [Code(instructions)], folded=True),
    ]
    headline = [HeadlineRow("silicone in the cavity", round(mold.silicone_mm3 / 1e3, 2), "ml")]
    if (bolts := mold.bolts) is not None:
        headline.append(HeadlineRow("screws with nuts", f"{bolts.number} {mold.options.screw} x {bolts.length_mm:g}"))
    page = write_page(
        out,
        f"Mold of {title}",
        headline,
        sections,
        [Figure("mold.png", "As it is poured, taken apart")],
        command="export --mold",
        outcome=f"{len(printed)} parts",
        notes=remarks,
        file=PAGE,
    )
    return [page, *(picture.path for picture in pictures)]


def _steps(mold: Mold, shells: Mapping[str, Shell], printed: Mapping[str, Shell]) -> list[CastingStep]:
    surfaces = {name: part.surface for name, part in shells.items()}
    halves, laid = {name: surfaces[name] for name in HALVES}, _strips(mold)
    lying = {name: part.surface for name, part in in_a_row(printed).items()}
    layers = (
        f"mold.3mf has all parts as they should be printed, outer faces down, without support: layers of "
        f"{mold.options.machine.layer_mm:g} mm or less."
    )
    return [
        CastingStep("print", "Print the parts", [layers], lying, lying=True),
        CastingStep("prepare", "Prepare the halves", prepare_lines(mold), standing(taken_apart(halves) | laid)),
        CastingStep("close", "Close the halves", close_lines(mold), standing(halves | laid)),
        *(_pouring(mold, pour, halves, surfaces) for pour in mold.pours),
        _opening_step(mold, surfaces),
    ]


def _strips(mold: Mold) -> dict[str, Triangles]:
    """Return the strips of the gauges, as a part of pictures; empty without gauges."""
    laid = strips(mold.foils, mold.layout, mold.options)
    return {} if laid is None else {"strips": laid}


def _pouring(mold: Mold, pour: Pour, closed: Mapping[str, Triangles], surfaces: Mapping[str, Triangles]) -> CastingStep:
    cast = {f"silicone_{k}" if k > 1 else "silicone": body.surface for k, body in enumerate(pour.cast, 1)}
    lid = {name: surfaces[name] for name in pour.others}
    if pour.ports is None:  # the lid is pushed in after the silicone
        above = 0.8 * mold.layout.top
        lid = {name: Triangles(part.points - [0.0, above, 0.0], part.faces) for name, part in lid.items()}
    word, title = "pour", "Pour"
    if len(mold.pours) > 1:
        word, title = f"pour_{pour.name}", f"Pour {len(pour.cast)} of {len(mold.pours)}: {pour.name}"
    return CastingStep(word, title, pour_lines(mold, pour), standing({**closed, **cast, **lid}))


def _opening_step(mold: Mold, surfaces: Mapping[str, Triangles]) -> CastingStep:
    last = mold.pours[-1]
    parts = {name: surfaces[name] for name in (*HALVES, *last.others)}
    stay = {f"sensor_{i}": body.surface for i, body in enumerate(last.cast, 1)}
    stay |= {name: part for name, part in parts.items() if kind(name) == "insert"}
    return CastingStep("open", "Open the mold", open_lines(mold), standing(taken_apart(parts) | stay))


def _opening(mold: Mold) -> list[str | Table]:
    d = mold.draft
    lines: list[str | Table] = [
        Table(
            ("least draft", "walls below 1 degree", "their length along the opening", "deepest undercut"),
            [(f"{d.angle_deg:.3g} deg", f"{d.wall_mm2:.3g} mm2", f"{d.wall_mm:.3g} mm", f"{d.undercut_mm:.2g} mm")],
        )
    ]
    if d.wall_mm2:
        lines.append("Walls without draft rub along the silicone: release agent matters there.")
    if d.undercut_mm:
        lines.append(f"{d.where[0].upper()}{d.where[1:]}: stretch the silicone over it.")
    return lines


FILES = ("mold_*.stl", "mold*.3mf", "mold.step", "mold_exploded.step", "sheet.txt", "mold.png", PAGE,
         "mold_step_*.png")  # fmt: skip
"""Patterns of the files of a mold."""

_CHECKED_LAYER_MM = 0.5  # height of the layers in which islands are looked for
_THICKNESS_TOLERANCE = 0.97  # chords and slanted rays make walls look thinner


def write_mold(
    title: str, mold: Mold, body: Shell, out: Path, text: bool, report: Progress, silicone: Silicone | None = None
) -> tuple[list[Path], list[str]]:
    """Write all files of a mold; returns them, and remarks for the user.

    Parameters
    ----------
    body : the finger's shell; the cavity is made as finely
    text : STL as text
    silicone : that the scene names, for the instructions
    """
    report.stage("parts and picture")
    # a finger of triangles has no tolerance of its own
    fine = body.tolerance_mm or mold.options.machine.tolerance_mm, body.angle or ANGLE
    shells = {name: mold.shell(name, *fine) for name in mold.parts}
    printed = as_printed(shells)
    surfaces = {name: part.surface for name, part in shells.items()}
    files = [*(out / f"mold_{name}.stl" for name in printed), out / "mold.3mf"]
    with ThreadPoolExecutor(1) as pool:  # PyVista renders in a process of its own for some seconds
        drawn = pool.submit(_picture, out / "mold.png", title, mold, surfaces, printed)
        for path, part in zip(files, printed.values(), strict=False):
            write_stl(path, part.surface, text)
        write_3mf(out / "mold.3mf", in_a_row(printed))
        if mold.body.cad is not None:
            files += _write_steps(out, mold, surfaces)
        instructions = sheet(title, mold, printed, silicone)
        with atomic(out / "sheet.txt") as temporary:
            temporary.write_text(instructions, encoding="utf-8")
        drawn.result()
    remarks = print_remarks(printed, mold.options.machine.thinnest_mm)
    remarks += [
        f"{label} is rigid: print mold_{insert_name(label)}.stl, and push it onto its lid before the silicone is poured"
        for label in mold.pours[-1].inserts
    ]
    if mold.body.cad is None:
        remarks.append("no mold.step: the finger holds triangles, and so do the halves of its mold")
    files += [out / "sheet.txt", out / "mold.png"]
    return files + mold_page(title, mold, shells, printed, out, instructions, remarks), remarks


def _write_steps(out: Path, mold: Mold, surfaces: Mapping[str, Triangles]) -> list[Path]:
    """Write the assembled mold, and the mold taken apart."""
    from build123d import Compound, Pos

    shifts, apart = separations(surfaces), []
    for name, solid in mold.parts.items():
        moved = Pos(*map(float, shifts[name])) * solid
        moved.label = name
        apart.append(moved)
    write_step(out / "mold.step", Compound(label="mold", children=list(mold.parts.values())))
    write_step(out / "mold_exploded.step", Compound(label="mold", children=apart))
    return [out / "mold.step", out / "mold_exploded.step"]


def print_remarks(printed: Mapping[str, Shell], thinnest_mm: float) -> list[str]:
    """Return what a slicer would find wrong with the parts."""
    remarks = []
    for name, part in printed.items():
        flaws = check_print(part.surface, _CHECKED_LAYER_MM)
        where = ", ".join(f"{c:.4g}" for c in flaws.thinnest)
        if flaws.wall_mm < _THICKNESS_TOLERANCE * thinnest_mm:
            remarks.append(
                f"mold_{name}: a wall of {flaws.wall_mm:.2g} mm near ({where}) mm is thinner than the printer makes, "
                f"{thinnest_mm:g} mm"
            )
        if len(flaws.islands):
            where = ", ".join(f"{c:.4g}" for c in flaws.islands[0])
            remarks.append(f"mold_{name}: begins in the air near ({where}) mm, and needs support there")
    return remarks


def _picture(
    path: Path, title: str, mold: Mold, surfaces: Mapping[str, Triangles], printed: Mapping[str, Shell]
) -> None:
    cast = [body.surface for body in mold.pours[-1].cast]
    silicone = {f"sensor_{i}" if i else "sensor": surface for i, surface in enumerate(cast)}
    labels = {name: f"{sizes(part)} mm" for name, part in printed.items()}
    labels["sensor"] = f"{mold.silicone_mm3 / 1e3:.3g} ml"
    if mold.foils:
        labels["strips"] = "\n".join(name for foil in mold.foils for name in foil.names)
    picture(path, {**surfaces, **silicone, **_strips(mold)}, f"Mold of {title}: as it is poured, taken apart", labels)
