"""Files of a mold: parts as STL and 3MF, the assembly as STEP, instructions, a picture, and mold.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finger3d.geometry.surface import Triangles
from finger3d.io import atomic
from finger3d.materials.silicones import Silicone
from finger3d.mold.body import ANGLE, Shell, shell, write_3mf, write_step, write_stl
from finger3d.mold.foils import strips
from finger3d.mold.parts import HALVES, Mold, Pour
from finger3d.mold.printing import Bed, as_printed, beds, check_print
from finger3d.mold.sheet import close_lines, open_lines, oversize, pour_lines, prepare_lines, sheet, thread_lines
from finger3d.plotting.mold import StepPicture, kind, picture, separations, standing, step_pictures
from finger3d.progress import Progress
from finger3d.report.build import Code, Figure, HeadlineRow, PageSection, Table, write_page

PAGE = "mold.html"

_BED_THICKNESS_MM = 2.0


@dataclass(frozen=True)
class CastingStep:
    """Step of casting: the word in its file's name, its title, its lines, and the parts of its picture."""

    word: str
    title: str
    lines: Sequence[str]
    parts: Mapping[str, Triangles]
    on_bed: bool = False


def mold_page(
    title: str,
    mold: Mold,
    shells: Mapping[str, Shell],
    printed: Mapping[str, Shell],
    packed: Sequence[Bed],
    out: Path,
    instructions: str,
    remarks: Sequence[str],
) -> list[Path]:
    """Write mold.html and the pictures of its steps; returns the files.

    Parameters
    ----------
    shells : parts in the assembled position
    printed : parts as they lie on the bed
    packed : beds with parts in their places
    instructions : text of sheet.txt, repeated at the end
    remarks : warnings, shown at the top
    """
    steps = _steps(mold, shells, packed)
    pictures = [
        StepPicture(out / f"mold_step_{i}_{step.word}.png", step.parts, step.on_bed) for i, step in enumerate(steps, 1)
    ]
    step_pictures(pictures)
    sections = [
        PageSection(f"{i}. {step.title}", [*step.lines, Figure(picture.path.name, step.title)])
        for i, (step, picture) in enumerate(zip(steps, pictures, strict=True), 1)
    ]
    sections += [
        PageSection("Parts", [_table(printed)]),
        PageSection("Opening", _opening(mold)),
        PageSection("sheet.txt", [Code(instructions)], folded=True),
    ]
    page = write_page(
        out,
        f"Mold of {title}",
        _headline(mold),
        sections,
        [Figure("mold.png", "As it is poured, taken apart")],
        command="export --mold",
        outcome=f"{len(printed)} parts, {len(packed)} bed{'s' if len(packed) > 1 else ''}",
        notes=remarks,
        file=PAGE,
    )
    return [page, *(picture.path for picture in pictures)]


def _headline(mold: Mold) -> list[HeadlineRow]:
    rows = [HeadlineRow("silicone in the cavities", round(mold.silicone_mm3 / 1e3, 2), "ml")]
    for pour in mold.pours:
        if pour.ports is not None and pour.ports.riser is not None:
            percent = 100.0 * pour.ports.riser.volume_mm3 * len(mold.layout.places) / pour.silicone_mm3
            named = f" of {pour.name}" if len(mold.pours) > 1 else ""
            rows.append(HeadlineRow(f"riser{named} and its hole", f"{percent:.3g} % of the cavity"))
    if (bolts := mold.bolts) is not None:
        rows.append(HeadlineRow("screws with nuts", f"{bolts.number} {mold.options.screw} x {bolts.length_mm:g}"))
    return rows


def _steps(mold: Mold, shells: Mapping[str, Shell], packed: Sequence[Bed]) -> list[CastingStep]:
    surfaces = {name: part.surface for name, part in shells.items()}
    halves = {name: surfaces[name] for name in HALVES}
    steps = [_printing(mold, bed, len(packed)) for bed in packed[:1]]
    steps.append(_preparing(mold, halves))
    closed = dict(halves)
    if mold.foils:
        steps.append(_threading(mold, halves, surfaces))
        closed |= {name: part for name, part in surfaces.items() if kind(name) == "plug"}
    steps.append(CastingStep("close", "Close the halves", close_lines(mold), standing(closed)))
    for i, pour in enumerate(mold.pours):
        steps.append(_pouring(mold, i, pour, closed, surfaces))
    steps.append(_opening_step(mold, surfaces))
    return steps


def _printing(mold: Mold, bed: Bed, beds: int) -> CastingStep:
    o, parts = mold.options, {name: part.surface for name, part in bed.placed.items()}
    size = o.bed_mm
    parts["bed"] = _box((0.0, 0.0, -_BED_THICKNESS_MM), (size[0], size[1], 0.0))
    lines = [
        f"mold.3mf has all parts as they should be printed, outer faces down, without support: layers of "
        f"{o.machine.layer_mm:g} mm or less."
    ]
    if beds > 1:
        lines.append(f"The parts need {beds} beds: mold.3mf, then mold_bed_2.3mf and so on.")
    if o.coupon:
        lines.append("Print the coupon first: the least clearance that the peg enters by hand is that of the mold.")
    return CastingStep("print", "Print the parts", lines, parts, on_bed=True)


def _preparing(mold: Mold, halves: Mapping[str, Triangles]) -> CastingStep:
    shifts = separations({name: (part.low, part.high) for name, part in halves.items()})
    apart = {name: Triangles(part.points + shifts[name], part.faces) for name, part in halves.items()}
    return CastingStep("prepare", "Prepare the halves", prepare_lines(mold), standing(apart))


def _threading(mold: Mold, halves: Mapping[str, Triangles], surfaces: Mapping[str, Triangles]) -> CastingStep:
    laid = strips(mold.foils, mold.layout, mold.options)
    assert laid is not None
    plugs = {name: part for name, part in surfaces.items() if kind(name) == "plug"}
    parts = {"half_b": halves["half_b"], **{n: p for n, p in plugs.items() if n.endswith("b")}, "strips": laid}
    return CastingStep("gauges", "Thread the strips of the gauges", thread_lines(mold), standing(parts))


def _pouring(
    mold: Mold, i: int, pour: Pour, closed: Mapping[str, Triangles], surfaces: Mapping[str, Triangles]
) -> CastingStep:
    several = len(mold.pours) > 1
    pour_parts = {name: surfaces[name] for name in pour.others if name in surfaces}
    high = max(float(part.high[1] - part.low[1]) for part in closed.values())
    parts: dict[str, Triangles] = dict(closed)
    for k, body in enumerate(pour.cast):
        level = k if several else 0
        parts[f"silicone_{level + 1}" if level else "silicone"] = body.surface
        if not several:
            parts.update({f"sensor_{j}": b.surface for j, b in enumerate(pour.cast[1:], 2)})
            break
    if pour.ports is None:  # the lid is pushed in after the silicone
        pour_parts = {n: Triangles(p.points - [0.0, 0.8 * high, 0.0], p.faces) for n, p in pour_parts.items()}
    parts |= pour_parts
    named = f" {i + 1} of {len(mold.pours)}: {pour.name}" if several else ""
    return CastingStep(
        f"pour_{pour.name}" if several else "pour", f"Pour{named}", pour_lines(mold, pour), standing(parts)
    )


def _opening_step(mold: Mold, surfaces: Mapping[str, Triangles]) -> CastingStep:
    last = mold.pours[-1]
    names = [*HALVES, *last.others] if len(mold.pours) > 1 else list(surfaces)
    parts = {name: surfaces[name] for name in names if name in surfaces}
    for i, body in enumerate(mold.bodies):
        parts["sensor" if i == 0 else f"sensor_{i + 1}"] = body.surface
    shifts = separations({name: (part.low, part.high) for name, part in parts.items()})
    apart = {name: Triangles(part.points + shifts[name], part.faces) for name, part in parts.items()}
    apart.update({name: part for name, part in parts.items() if kind(name) == "insert"})  # they stay in the finger
    if mold.options.carrier:
        apart["carrier"] = parts["carrier"]
    return CastingStep("open", "Open the mold", open_lines(mold), standing(apart))


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


def _table(printed: Mapping[str, Shell]) -> Table:
    rows = [(name, " x ".join(f"{e:.1f}" for e in part.extent), f"mold_{name}.stl") for name, part in printed.items()]
    return Table(("part", "size on the bed, mm", "file"), rows)


def _box(low: Sequence[float], high: Sequence[float]) -> Triangles:
    from itertools import product

    points = np.array(list(product(*zip(low, high, strict=True))))
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return Triangles(points, np.array([t for a, b, c, d in sides for t in ([a, b, c], [a, c, d])]))


FILES = ("mold_*.stl", "mold*.3mf", "mold.step", "mold_exploded.step", "sheet.txt", "mold.png", PAGE,
         "mold_step_*.png")  # fmt: skip
"""Patterns of the files of a mold."""

_CHECKED_LAYER_MM = 0.5  # height of the layers in which islands are looked for
_THICKNESS_TOLERANCE = 0.97  # chords and slanted rays make walls look thinner


def write_mold(
    title: str,
    mold: Mold,
    body: Shell,
    out: Path,
    text: bool,
    report: Progress,
    further: Mapping[str, Shell] | None = None,
    silicone: Silicone | None = None,
) -> tuple[list[Path], list[str]]:
    """Write all files of a mold; returns them, and remarks for the user.

    Parameters
    ----------
    body : the finger's shell; the cavity is made as finely
    text : STL as text
    further : parts beside the mold, as they lie on the bed
    silicone : that the scene names, for the instructions
    """
    report.stage("parts and picture")
    # a finger of triangles has no tolerance of its own
    fine = body.tolerance_mm or mold.options.machine.tolerance_mm, body.angle or ANGLE
    shells = {name: mold.shell(name, *fine) for name in mold.parts}
    printed = {**as_printed(shells), **(further or {})}
    packed = beds(printed, mold.options.bed_mm)
    files = [out / f"mold_{name}.stl" for name in printed]
    with ThreadPoolExecutor(1) as pool:  # PyVista renders in a process of its own for some seconds
        drawn = pool.submit(_picture, out / "mold.png", title, mold, body, shells, printed)
        for path, part in zip(files, printed.values(), strict=True):
            write_stl(path, part.surface, text)
        for i, bed in enumerate(packed):
            files.append(out / ("mold.3mf" if i == 0 else f"mold_bed_{i + 1}.3mf"))
            write_3mf(files[-1], bed.placed)
        if mold.body.cad is not None:
            files += _write_steps(out, mold)
        extent = np.max([bed.extent for bed in packed], axis=0)
        instructions = sheet(title, mold, printed, extent, silicone)
        with atomic(out / "sheet.txt") as temporary:
            temporary.write_text(instructions, encoding="utf-8")
        drawn.result()
    remarks = [f"mold_{n}: {why}" for n, part in printed.items() if (why := oversize(part, mold.options.bed_mm))]
    remarks += _print_remarks(printed, mold.options.machine.thinnest_mm)
    if len(packed) > 1:
        remarks.append(f"the parts need {len(packed)} beds; mold.3mf is the first")
    if mold.body.cad is None:
        remarks.append("no mold.step: the finger holds triangles, and so do the halves of its mold")
    files += [out / "sheet.txt", out / "mold.png"]
    return files + mold_page(title, mold, shells, printed, packed, out, instructions, remarks), remarks


def _write_steps(out: Path, mold: Mold) -> list[Path]:
    """Write the assembled mold, and the mold taken apart."""
    from build123d import Compound, Pos

    boxes = {}
    for name, solid in mold.parts.items():
        bounds = solid.bounding_box()
        boxes[name] = np.array([*bounds.min]), np.array([*bounds.max])
    shifts = separations(boxes)
    apart = []
    for name, solid in mold.parts.items():
        moved = Pos(*map(float, shifts[name])) * solid
        moved.label = name
        apart.append(moved)
    write_step(out / "mold.step", Compound(label="mold", children=list(mold.parts.values())))
    write_step(out / "mold_exploded.step", Compound(label="mold", children=apart))
    return [out / "mold.step", out / "mold_exploded.step"]


def _print_remarks(printed: Mapping[str, Shell], thinnest_mm: float) -> list[str]:
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
    path: Path, title: str, mold: Mold, body: Shell, shells: dict[str, Shell], printed: dict[str, Shell]
) -> None:
    parts = {name: part.surface for name, part in shells.items()}
    sensor = mold.body
    for i, x in enumerate(mold.layout.places, 1):
        name = "sensor" if len(mold.layout.places) == 1 else f"sensor_{i}"
        cast = sensor.at(x)
        parts[name] = cast.surface if cast.cad is None else shell(cast.cad, body.tolerance_mm, name, body.angle).surface
    labelled: dict[str, str] = {}
    for name in printed.keys() & parts.keys():
        if kind(name) not in {kind(other) for other in labelled}:  # one label for parts of a kind
            labelled[name] = " x ".join(f"{e:.1f}" for e in printed[name].extent) + " mm"
    first = "sensor" if len(mold.layout.places) == 1 else "sensor_1"
    labelled[first] = f"{mold.silicone_mm3 / len(mold.layout.places) / 1e3:.3g} ml"
    if (laid := strips(mold.foils, mold.layout, mold.options)) is not None:
        parts["strips"] = laid
        labelled["strips"] = "\n".join(name for foil in mold.foils for name in foil.names)
    picture(path, parts, f"Mold of {title}: as it is poured, taken apart", labelled)
