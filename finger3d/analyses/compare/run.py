"""Comparison of a scene in plane stress, in plane strain and as a solid."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d._machine import versions
from finger3d._ranges import FARTHEST_MM
from finger3d._types import Tree
from finger3d.analyses.compare.cases import press_with_errors, section_of, widened
from finger3d.analyses.compare.verdict import WITHIN, Deviation, crossing_width, deviations, numbers_table, verdict
from finger3d.errors import Finger3dError, Outcome, UnresolvedError
from finger3d.geometry.design import lacks_section
from finger3d.io import claimed, write_csv, write_json, write_text
from finger3d.mechanics.model import Model
from finger3d.objects import PlacedObject
from finger3d.progress import Progress
from finger3d.results.comparison import Case

if TYPE_CHECKING:
    from finger3d.scene import Scene, Source


_WIDTHS = (1.0, 4.0, 12.0, 24.0)
"""Default widths of further solids, in heights of the finger."""

_INCOMPLETE = "incomplete: the comparison is running or was interrupted; the cases written are complete"


@dataclass(frozen=True, repr=False)
class Comparison:
    """Result of `compare`.

    Attributes
    ----------
    cases : the models that were solved
    verdict : on them, in sentences
    table : text of the numbers at the scene's width: the head, then a row for each quantity
    out : folder of the files
    """

    cases: tuple[Case, ...]
    verdict: tuple[str, ...]
    table: tuple[Sequence[str], ...]
    out: Path

    def __repr__(self) -> str:
        """One line."""
        return f"<Comparison of {len(self.cases)} cases: {self.outcome}; {self.out}>"

    def _repr_html_(self) -> str:
        from finger3d._notebook import card
        from finger3d.report.build import number
        from finger3d.results.comparison import FORCE

        rows = [
            (c.model, f"{c.width_mm:g}", number(c.numbers[FORCE], c.errors.get(FORCE)) if c.ok else str(c.outcome))
            for c in self.cases
        ]
        said = f"{self.outcome}, {len(self.cases)} cases"
        return card("2D against 3D", said, rows, self.verdict, head=("model", "width (mm)", "force per width (N/mm)"))

    @property
    def outcome(self) -> Outcome:
        """Outcome of the first case that did not converge, else CONVERGED."""
        return next((c.outcome for c in self.cases if not c.ok), Outcome.CONVERGED)


def compare(
    scene: Source,
    out: str | Path,
    widths: Sequence[float] | None = None,
    report: Progress | None = None,
    overrides: Sequence[str] = (),
) -> Comparison:
    """Solve a scene in plane stress, in plane strain and as a solid, and compare the results.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene; its domain is ignored
    out : folder for compare.csv, compare.json, compare.png, report.html and scene.toml
    widths : further widths of the finger, mm; None takes multiples of its height
    report : progress of the cases
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Returns
    -------
    Comparison
        Cases may have failed to converge; the verdict names them.
    """
    from finger3d.analyses.effects_by_need import settled
    from finger3d.scene import scene_of

    report = report or Progress()
    scene = scene_of(scene, overrides)
    tolerance = scene.tables.mesh.tolerance
    if tolerance is not None:
        raise Finger3dError(
            f"{scene.path or scene.title}: mesh.tolerance = {tolerance:g}: compare needs fixed edge lengths; press "
            "determines them and writes them to the scene.toml of its results, which compare accepts"
        )
    solid, _ = settled(_as_solid(scene), report)
    model = solid.model()
    other_widths = _other_widths(model, widths)
    _check(model, other_widths)
    with claimed(out, "compare") as folder:
        return _solve_and_write(solid, model, other_widths, folder, report)


def _solve_and_write(solid: Scene, model: Model, widths: list[float], folder: Path, report: Progress) -> Comparison:
    """Solve every case and write all of them after each, so that an interruption loses none."""
    for name in ("compare.csv", "compare.json", "compare.png", "report.html"):
        (folder / name).unlink(missing_ok=True)
    write_text(folder / "scene.toml", solid.to_toml())
    variants = list(_variants(model, widths))
    report.steps_total = len(variants)
    cases: list[Case] = []
    for done, (name, variant) in enumerate(variants, start=1):
        report.stage(f"{name}, {variant.design.width_mm:g} mm wide")
        cases.append(_press(name, variant, model))
        report.step(done, len(variants), _remark(cases[-1]))
        comparison = _compared(model, cases, folder)
        _write(comparison, solid, model.design.height_mm, complete=done == len(variants))
    from finger3d.plotting.comparison import draw
    from finger3d.report.compare import compare_page

    draw(folder / "compare.png", cases, model.design.width_mm, solid.title)
    compare_page(folder).write(folder)
    return comparison


def _as_solid(scene: Scene) -> Scene:
    """Return the scene as a solid, so that default mesh sizes are those of a solid in the sections, too."""
    from finger3d.scene import parse

    if scene.domain == "solid":
        return scene
    return parse({**scene.given, "model": {"domain": "solid"}}, path=scene.path)


def _other_widths(model: Model, widths: Sequence[float] | None) -> list[float]:
    own = model.design.width_mm
    height = model.design.height_mm
    chosen = [float(f"{w * height:.2g}") for w in _WIDTHS] if widths is None else [float(w) for w in widths]
    for width in chosen:
        if not (np.isfinite(width) and width > 0.0):
            raise Finger3dError(f"--widths {width:g}: must be positive numbers of mm, for instance 5,20,50,200")
    return sorted({w for w in chosen if w != own})


def _check(model: Model, widths: Sequence[float]) -> None:
    """Refuse a scene that has no plane model."""
    if model.design.section() is None:
        raise Finger3dError(
            f'compare: finger.geometry = "{model.design.name}" is {lacks_section(model.design)}, so there is no 2D '
            "model of it; take an extruded design"
        )
    if narrow := next((t.name for t in model.taxels if t.width_mm is None), None):
        raise Finger3dError(f'compare: taxel "{narrow}" has no width_mm; the solids need it')
    if any(leg.slide_z_mm for leg in model.legs):
        raise Finger3dError("compare: press.slide_z_mm must be 0.0; a section cannot slide along its width")
    reach = [(f'gauge "{g.name}"', g.z_mm, 0.0) for g in model.gauges]
    reach += [(f'marker "{m.name}"', m.z_mm, 0.0) for m in model.markers]
    reach += [(f'taxel "{t.name}"', t.z_mm, t.width_mm or 0.0) for t in model.taxels]
    for name, z, across in reach:
        if beyond := [w for w in widths if 2.0 * abs(z) + across > w * (1.0 + 1e-9)]:
            raise Finger3dError(
                f"compare: {name} at z_mm = {z:g} is outside a finger {beyond[0]:g} mm wide; "
                "give larger widths or another z_mm"
            )


def _variants(model: Model, widths: Sequence[float]) -> Iterator[tuple[str, Model]]:
    """Yield the name and the model of every case; solid and sections of one width have the same in-plane mesh."""
    strain, stress = section_of(model, "plane-strain"), section_of(model, "plane-stress")
    yield "plane strain", strain
    yield "plane stress", stress
    yield "solid", model
    for width in widths:
        wide = widened(model, width)
        yield "plane strain", section_of(wide, "plane-strain")
        yield "plane stress", section_of(wide, "plane-stress")
        yield "solid", wide


def _press(name: str, variant: Model, scene: Model) -> Case:
    """Press a variant; if its mesh is too coarse for the object, fail only where it has the width of the scene."""
    try:
        return press_with_errors(name, variant)
    except UnresolvedError:
        if variant.design.width_mm == scene.design.width_mm:
            raise
        mesher = "swept" if variant.domain != "solid" else variant.mesh.mesher
        return Case(name, variant.design.width_mm, variant.mesh.size_mm, mesher, Outcome.UNRESOLVED)


def _remark(case: Case) -> str:
    if not case.ok:
        return f"{case.model}, {case.width_mm:g} mm wide: {case.outcome}"
    force = case.numbers["force_N_per_mm"]
    return f"{case.model}, {case.width_mm:g} mm wide, edges of {case.size_mm:.3g} mm: {force:.4g} N per mm"


def _compared(model: Model, cases: Sequence[Case], folder: Path) -> Comparison:
    table = numbers_table(cases, model.design.width_mm)
    return Comparison(tuple(cases), tuple(_verdict(model, cases)), tuple(table), folder)


def _verdict(model: Model, cases: Sequence[Case]) -> list[str]:
    turns = any(leg.turn_x or leg.turn_y for leg in model.legs)
    lines = verdict(cases, model.design.width_mm, model.design.height_mm, turns)
    if _varies_along_width(model):
        lines.append("The object changes along the width; the plane models take its section at z = 0.")
    return [*lines, *(f"Warning: {w}." for w in model.warnings)]


def _varies_along_width(model: Model) -> bool:
    half = 0.5 * model.design.width_mm
    x, z = np.meshgrid(np.linspace(-1.0, 1.0, 21) * model.design.half_length_mm, np.linspace(-half, half, 21))
    height = PlacedObject.of(model.object, 0.0).height(x, z)
    height[np.isnan(height)] = FARTHEST_MM  # beside the object
    return bool(np.ptp(height, axis=0).max() > 1e-9 * model.design.height_mm)


def _write(comparison: Comparison, scene: Scene, height_mm: float, complete: bool) -> None:
    """Write all files but the picture and the page."""
    folder, cases = comparison.out, comparison.cases
    rows = [_row(case, height_mm) for case in cases]
    names = list(dict.fromkeys(key for row in rows for key in row))
    write_csv(folder / "compare.csv", {key: [row.get(key, "") for row in rows] for key in names})
    by_width = {name: deviations(name, cases) for name in ("plane strain", "plane stress")}
    write_json(
        folder / "compare.json",
        {
            "scene": scene.as_dict(),
            "outcome": str(comparison.outcome) if complete else _INCOMPLETE,
            "verdict": comparison.verdict,
            "table": comparison.table,
            "within": WITHIN,
            "width_within": {name: _width_within(found, name == "plane stress") for name, found in by_width.items()},
            "deviation_of_force": {name: [asdict(d) for d in found] for name, found in by_width.items()},
            "cases": [case.as_dict() for case in cases],
            "versions": versions(),
        },
    )


def _width_within(found: Sequence[Deviation], narrow: bool) -> dict[str, float] | None:
    at = crossing_width(found, narrow) if len(found) > 1 else None
    return None if at is None else dict(zip(("width_mm", "low_mm", "high_mm"), at, strict=True))


def _row(case: Case, height: float) -> Tree:
    row: Tree = {
        "model": case.model,
        "width_mm": case.width_mm,
        "width_over_height": case.width_mm / height,
        "size_mm": case.size_mm,
        "mesher": case.mesher,
        "outcome": str(case.outcome),
    }
    for key, value in case.numbers.items():
        row[key] = value
        row[f"{key}_error"] = case.errors.get(key, "")
    return row | {"seconds": case.seconds}
