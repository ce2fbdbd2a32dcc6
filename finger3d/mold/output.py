"""Files of a mold: parts as STL and 3MF, the assembly as STEP, instructions and a picture."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from finger3d.io import atomic
from finger3d.materials.silicones import Silicone
from finger3d.mold.foils import strips
from finger3d.mold.packing import as_printed, beds
from finger3d.mold.page import PAGE, mold_page
from finger3d.mold.parts import Mold
from finger3d.mold.sheet import oversize, sheet
from finger3d.mold.shell import ANGLE, Shell, shell, write_3mf, write_step, write_stl
from finger3d.mold.slicer import check_print
from finger3d.plotting.mold import kind, picture, separations
from finger3d.progress import Progress

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
