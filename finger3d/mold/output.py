"""Files of a mold: parts as STL and 3MF, the assembly as STEP, instructions, pictures, and mold.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finger3d._types import Float
from finger3d.geometry.surface import Triangles
from finger3d.io import atomic
from finger3d.materials.silicones import Silicone
from finger3d.mold.body import ANGLE, Shell, write_3mf, write_step, write_stl
from finger3d.mold.cover import strips
from finger3d.mold.parts import HALVES, Mold
from finger3d.mold.pours import Pour, insert_name
from finger3d.mold.regions import manifold
from finger3d.mold.sheet import close_lines, open_lines, pour_lines, prepare_lines, sheet, sizes
from finger3d.plotting.mold import Scenery, kind, scenery, scenery_on_the_bed, standing, taken_apart, write_pictures
from finger3d.progress import Progress
from finger3d.report.build import Code, Figure, HeadlineRow, Page, PageSection, Table

_OPPOSED = -0.9  # cosine between the normals of the two sides of a wall; sharp edges are no walls
_RAYS = 1500  # of a part
_NEAR_MM = 1e-4  # distance from a surface at which a ray starts
_BEND = 1e-3  # of a ray, so that it does not run along a face or hit an edge exactly
_LAYER_MM = 0.5  # height of the layers in which islands are looked for
_LEAST_OVERLAP = 1e-6  # of an island's area that must lie on the layer below


def thickness(part: Triangles) -> tuple[float, Float]:
    """Return the least thickness (mm) of the walls of a closed body and where it is (3,), by rays inward.

    Rays start in every triangle, in larger ones more often, and only hits on a face that looks the other way count.
    Thin walls narrower than the distance of rays may be missed.
    """
    body = manifold(part)
    area = np.linalg.norm(part.area_vectors, axis=1)
    order = np.argsort(-area)[:_RAYS]
    number = np.maximum(1, np.round(_RAYS * area[order] / area.sum()).astype(int))
    random = np.random.default_rng(0)
    owner = np.repeat(order, number)
    weights = random.dirichlet((1.0, 1.0, 1.0), len(owner))
    starts = np.einsum("ij,ijk->ik", weights, part.corners[owner])
    normals = part.normals[owner]
    ends = starts - (normals + _BEND * random.standard_normal(normals.shape)) * part.size
    starts = starts - normals * _NEAR_MM
    least, where = np.inf, starts[0]
    for start, end, normal in zip(starts, ends, normals, strict=True):
        crossed = body.ray_cast(tuple(start), tuple(end))
        if not crossed or np.dot(crossed[0].normal, normal) > _OPPOSED:
            continue
        far = float(np.linalg.norm(np.asarray(crossed[0].position) - start)) + _NEAR_MM
        if far < least:
            least, where = far, start
    return least, where


def islands(part: Triangles) -> Float:
    """Return the middles (n, 3), mm, of the pieces of a layer of which nothing lies on the layer below.

    The part lies on the bed: z up, its lowest point on z = 0.
    """
    body, middles = manifold(part), []
    heights = np.arange(0.5 * _LAYER_MM, float(part.high[2]), _LAYER_MM)
    below = body.slice(float(heights[0]))
    for height in heights[1:]:
        layer = body.slice(float(height))
        for piece in layer.decompose():
            if (piece ^ below).area() <= _LEAST_OVERLAP * piece.area():
                x0, y0, x1, y1 = piece.bounds()
                middles.append([0.5 * (x0 + x1), 0.5 * (y0 + y1), float(height)])
        below = layer
    return np.array(middles).reshape(-1, 3)


GAP_MM = 6.0
"""Distance between parts in the 3MF file."""

_OUTER_FACE_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_LYING = {"half_a": np.diag([-1.0, 1.0, -1.0]), "half_b": np.eye(3)}
"""Rotation of the halves onto the bed, their outer face down and z up; lids and inserts lie with y up."""


def as_printed(parts: Mapping[str, Shell]) -> dict[str, Shell]:
    """Return the parts as they are printed, each with its lowest corner at the origin."""
    lying = {name: part.moved(_LYING.get(name, _OUTER_FACE_DOWN), np.zeros(3)) for name, part in parts.items()}
    return {name: part.moved(np.eye(3), -part.surface.low) for name, part in lying.items()}


def in_a_row(printed: Mapping[str, Shell]) -> dict[str, Shell]:
    """Return the parts side by side along x; programs of printers arrange them on their beds."""
    starts = np.cumsum([0.0] + [float(part.extent[0]) + GAP_MM for part in printed.values()])
    shifts = np.outer(starts, [1.0, 0.0, 0.0])
    return {name: part.moved(np.eye(3), by) for (name, part), by in zip(printed.items(), shifts, strict=False)}


PAGE = "mold.html"
_THICKNESS_TOLERANCE = 0.97  # chords and slanted rays make walls look thinner


@dataclass(frozen=True)
class CastingStep:
    """Step of casting: the word in its file's name, its title, its lines, and its picture."""

    word: str
    title: str
    lines: Sequence[str]
    view: Scenery


def mold_page(
    out: Path, title: str, mold: Mold, shells: Mapping[str, Shell], instructions: str, remarks: Sequence[str]
) -> list[Path]:
    """Write mold.html and its pictures; returns the files.

    Parameters
    ----------
    shells : parts in the assembled position
    instructions : text of sheet.txt, repeated at the end
    remarks : warnings, shown at the top
    """
    printed, surfaces = as_printed(shells), {name: part.surface for name, part in shells.items()}
    steps = _steps(mold, surfaces, printed)
    pictures = [out / f"mold_step_{i}_{step.word}.png" for i, step in enumerate(steps, 1)]
    views = dict(zip(pictures, (step.view for step in steps), strict=True))
    write_pictures({out / "mold.png": _exploded(title, mold, surfaces, printed), **views})
    figures = [Figure(picture.name, step.title) for step, picture in zip(steps, pictures, strict=True)]
    sections = [PageSection(f"{i}. {step.title}", [*step.lines, figures[i - 1]]) for i, step in enumerate(steps, 1)]
    rows = [(name, sizes(part), f"mold_{name}.stl") for name, part in printed.items()]
    sections += [
        PageSection("Parts", [Table(("part", "size as printed, mm", "file"), rows)]),
        PageSection("Opening", [_opening(mold)]),
        PageSection("sheet.txt", [Code(instructions)], folded=True),
    ]
    headline = [HeadlineRow("silicone in the cavity", round(mold.silicone_mm3 / 1e3, 2), "ml")]
    if (bolts := mold.bolts) is not None:
        headline.append(HeadlineRow("screws with nuts", f"{bolts.number} {mold.options.screw} x {bolts.length_mm:g}"))
    page = Page(
        f"Mold of {title}",
        headline,
        sections,
        [Figure("mold.png", "As it is poured, taken apart")],
        command="export --mold",
        outcome=f"{len(printed)} parts",
        notes=remarks,
    )
    return [page.write(out, PAGE), *views, out / "mold.png"]


def _steps(mold: Mold, surfaces: Mapping[str, Triangles], printed: Mapping[str, Shell]) -> list[CastingStep]:
    halves, laid = {name: surfaces[name] for name in HALVES}, _strips(mold)
    lying = {name: part.surface for name, part in in_a_row(printed).items()}
    layers = (
        f"mold.3mf has all parts as they should be printed, outer faces down, without support: layers of "
        f"{mold.options.machine.layer_mm:g} mm or less."
    )
    apart, closed = scenery(standing(taken_apart(halves) | laid)), scenery(standing(halves | laid))
    return [
        CastingStep("print", "Print the parts", [layers], scenery_on_the_bed(lying)),
        CastingStep("prepare", "Prepare the halves", prepare_lines(mold), apart),
        CastingStep("close", "Close the halves", close_lines(mold), closed),
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
    return CastingStep(word, title, pour_lines(mold, pour), scenery(standing({**closed, **cast, **lid})))


def _opening_step(mold: Mold, surfaces: Mapping[str, Triangles]) -> CastingStep:
    last = mold.pours[-1]
    parts = {name: surfaces[name] for name in (*HALVES, *last.others)}
    stay = {f"sensor_{i}": body.surface for i, body in enumerate(last.cast, 1)}
    stay |= {name: part for name, part in parts.items() if kind(name) == "insert"}
    return CastingStep("open", "Open the mold", open_lines(mold), scenery(standing(taken_apart(parts) | stay)))


def _opening(mold: Mold) -> str:
    depth, where = mold.undercut.depth_mm, mold.undercut.where
    if not depth:
        return f"The halves slide off along {mold.options.split}: the body has no undercut."
    return f"{where[0].upper()}{where[1:]}, an undercut of {depth:.2g} mm: stretch the silicone over it."


FILES = ("mold_*.stl", "mold*.3mf", "mold.step", "mold_exploded.step", "sheet.txt", "mold.png", PAGE,
         "mold_step_*.png")  # fmt: skip
"""Patterns of the files of a mold."""


def write_mold(
    title: str, mold: Mold, body: Shell, out: Path, report: Progress, silicone: Silicone | None = None
) -> tuple[list[Path], list[str]]:
    """Write all files of a mold; returns them, and remarks for the user.

    Parameters
    ----------
    body : the finger's shell; the cavity is made as finely
    silicone : that the scene names, for the instructions
    """
    from build123d import Compound

    report.stage("parts and pictures")
    # a finger of triangles has no tolerance of its own
    fine = body.tolerance_mm or mold.options.machine.tolerance_mm, body.angle or ANGLE
    shells = {name: mold.shell(name, *fine) for name in mold.parts}
    printed = as_printed(shells)
    for name, part in printed.items():
        write_stl(out / f"mold_{name}.stl", part.surface)
    write_3mf(out / "mold.3mf", in_a_row(printed))
    files = [*(out / f"mold_{name}.stl" for name in printed), out / "mold.3mf"]
    remarks = print_remarks(printed, mold.options.machine.thinnest_mm)
    remarks += [
        f"{label} is rigid: print mold_{insert_name(label)}.stl, and push it onto its lid before the silicone is poured"
        for label in mold.pours[-1].inserts
    ]
    if mold.body.cad is None:
        remarks.append("no mold.step: the finger holds triangles, and so do the halves of its mold")
    else:
        write_step(out / "mold.step", Compound(label="mold", children=list(mold.parts.values())))
        files.append(out / "mold.step")
    instructions = sheet(title, mold, printed, silicone)
    with atomic(out / "sheet.txt") as temporary:
        temporary.write_text(instructions, encoding="utf-8")
    return [*files, out / "sheet.txt", *mold_page(out, title, mold, shells, instructions, remarks)], remarks


def print_remarks(printed: Mapping[str, Shell], thinnest_mm: float) -> list[str]:
    """Return what a slicer would find wrong with the parts."""
    remarks = []
    for name, part in printed.items():
        wall, place = thickness(part.surface)
        if wall < _THICKNESS_TOLERANCE * thinnest_mm:
            remarks.append(
                f"mold_{name}: a wall of {wall:.2g} mm near ({_coordinates(place)}) mm is thinner than the printer "
                f"makes, {thinnest_mm:g} mm"
            )
        if len(hanging := islands(part.surface)):
            remarks.append(
                f"mold_{name}: begins in the air near ({_coordinates(hanging[0])}) mm, and needs support there"
            )
    return remarks


def _coordinates(place: Float) -> str:
    return ", ".join(f"{c:.4g}" for c in place)


def _exploded(title: str, mold: Mold, surfaces: Mapping[str, Triangles], printed: Mapping[str, Shell]) -> Scenery:
    """Return the labelled picture of all parts and of what is cast, taken apart."""
    cast = {f"sensor_{i}" if i else "sensor": body.surface for i, body in enumerate(mold.pours[-1].cast)}
    labels = {name: f"{sizes(part)} mm" for name, part in printed.items()}
    labels["sensor"] = f"{mold.silicone_mm3 / 1e3:.3g} ml"
    if mold.foils:
        labels["strips"] = "\n".join(name for foil in mold.foils for name in foil.names)
    parts = standing(taken_apart({**surfaces, **cast, **_strips(mold)}))
    return scenery(parts, f"Mold of {title}: as it is poured, taken apart", labels)
