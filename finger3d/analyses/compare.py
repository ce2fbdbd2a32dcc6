"""A scene solved in plane stress, plane strain and 3D, and how far the plane models are from the solid."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d._cost import duration
from finger3d._machine import versions
from finger3d._ranges import FARTHEST_MM
from finger3d._types import Float, Tree
from finger3d.accuracy.cost import forecast
from finger3d.accuracy.error_bars import gain, with_error
from finger3d.accuracy.estimate import estimate
from finger3d.errors import Finger3dError, Outcome, UnresolvedError
from finger3d.fem.mesh import CONTACT
from finger3d.geometry.design import lacks_section
from finger3d.io import claimed, write_csv, write_json, write_text
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import FACTOR
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.history import StepResult, contact_table, measure
from finger3d.mechanics.march.step_halving import march_automatic
from finger3d.mechanics.model import Domain, Model
from finger3d.mechanics.readings import Quantity, by_key, in_space, of_kind
from finger3d.objects import PlacedObject
from finger3d.progress import Progress
from finger3d.results.summary import FORCE, SHOWN, Case

if TYPE_CHECKING:
    from finger3d.scene import Scene, Source


_POINTS = 600
"""Largest number of contact points of the meshed part of a solid of another width; a press then takes a few seconds."""


def resized(model: Model, size_mm: float) -> Model:
    """Return the model with all edge lengths scaled alike."""
    base = model.mesh.base_size_mm * size_mm / model.mesh.size_mm
    return replace(model, mesh=replace(model.mesh, size_mm=size_mm, base_size_mm=base))


def section_of(model: Model, domain: Domain) -> Model:
    """Return the 2D model of a solid; its object does not turn out of the plane."""
    return replace(model, domain=domain, legs=tuple(replace(leg, turn_x=0.0, turn_y=0.0) for leg in model.legs))


def widened(model: Model, width_mm: float) -> Model:
    """Return a solid of another width on a swept mesh, coarser than the scene's where needed for `_POINTS` points."""
    design = replace(model.design, width_mm=width_mm)
    free = 4 // 2 ** len(set(PlacedObject.of(model.object, 0.0).mirrors()) & {"x", "z"})
    size = min(model.mesh.size_mm, width_mm / FACTOR)
    largest = min(min(design.height_mm, design.half_length_mm) / 4.0, width_mm) / FACTOR

    def points(size_mm: float) -> float:
        layers = max(2, math.ceil(width_mm / (2.0 * size_mm)))
        return float(free * (design.half_length_mm / size_mm + 1) * (layers + 1))

    while points(size) > _POINTS and 1.2 * size <= largest:
        size *= 1.2
    return resized(replace(model, design=design, mesh=replace(model.mesh, mesher="swept")), size)


def press_with_errors(name: str, model: Model) -> Case:
    """Press the model and estimate its errors; see `finger3d.accuracy.estimate.estimate`."""
    start = time.perf_counter()
    # The whole contact face is a candidate, because the extent of contact differs from model to model.
    problem = build(model, margin=math.inf)
    steps, chosen = march_automatic(problem)
    step, points = steps[-1], problem.points
    mesher = "swept" if problem.dim == 2 else model.mesh.mesher
    case = Case(name, model.design.width_mm, model.mesh.size_mm, mesher, step.outcome)
    if case.ok:
        found = estimate(problem, steps, numbers=lambda p, f: quantities(p.points, f), chosen=chosen)
        case = replace(
            case,
            numbers=quantities(points, step),
            lines=lines_along_x(points, step),
            strains=of_kind(step.readings, "gauge"),
            errors=found.totals(),
            companion=found.companion_numbers,
            ratio=found.ratio,
            method=found.method,
        )
    return replace(case, seconds=time.perf_counter() - start)


def quantities(points: ContactPoints, step: StepResult) -> dict[str, float]:
    """Return the quantities of a step that sections and solids have in common: N per mm of width, mm, MPa, strains."""
    numbers = measure(points, step)
    width = 2.0 * points.half_width_mm
    friction = np.abs(points.friction(step.state.force)).sum(axis=0)
    out = {
        "force_N_per_mm": numbers["normal_force_N"] / width,
        "friction_sum_N_per_mm": numbers["friction_sum_N"] / width,
        "friction_along_x_N_per_mm": float(friction[0]) / width,
        "friction_along_z_N_per_mm": float(friction[2]) / width,
        "outward_friction_x_N_per_mm": numbers["outward_friction_x_N"] / width,
        "contact_length_mm": 2.0 * numbers["contact_half_length_mm"],
        "stick_length_mm": 2.0 * numbers["stick_half_length_mm"],
    }
    if "contact_half_length_end_mm" in numbers:
        out["contact_length_end_mm"] = 2.0 * numbers["contact_half_length_end_mm"]
    if points.dim == 3:
        out["moment_y_Nmm_per_mm"] = numbers["moment_y_Nmm"] / width
    middle = lines_along_x(points, step)["z = 0"]
    out["peak_pressure_MPa"] = float(np.max(middle["pressure_MPa"], initial=0.0))
    return out | by_key(in_space(step.readings))


def lines_along_x(points: ContactPoints, step: StepResult) -> dict[str, Tree]:
    """Return tractions along x at z = 0, or near it on an unstructured mesh, and at the end of a solid."""
    table = contact_table(points, step)
    z = table["z_mm"]
    exact = 1e-6 * points.half_width_mm
    top = points.face == CONTACT
    middle = np.flatnonzero((np.abs(z) <= exact) & top)
    if len(middle) < 5:
        middle = np.flatnonzero((np.abs(z) <= points.band_mm) & top)
    chosen = {"z = 0": middle}
    if points.dim == 3:
        chosen["end"] = np.flatnonzero((np.abs(z - points.half_width_mm) <= exact) & top)
    keys = ("x_mm", "pressure_MPa", "shear_x_MPa", "shear_z_MPa", "status")
    out = {}
    for name, on in chosen.items():
        on = on[np.argsort(table["x_mm"][on], kind="stable")]
        out[name] = {k: np.asarray(table[k])[on].tolist() for k in keys}
    return out


WITHIN = 0.05
"""Relative deviation from the solid below which a plane model is called sufficient."""

_ASYMPTOTIC = 0.25
"""Deviation of plane strain below which it is extrapolated as 1/width; the ends are then independent of each other."""

_COMMON = 0.25
"""Smallest error bar of a deviation, relative to that of independent errors, if the errors cancel."""

_SURE = 2.0
"""Distance from the limit, in error bars, beyond which a deviation differs significantly from it."""


@dataclass(frozen=True)
class Deviation:
    """Relative deviation (plane - solid)/solid of a quantity at one width, and its error bar."""

    width_mm: float
    value: float
    error: float

    def text(self) -> str:
        """Return the magnitude in percent, for instance ``74 % (± 1 %)``."""
        return f"{rounded(100 * abs(self.value))} % (± {rounded(100 * self.error, 1)})"


def rounded(value: float, digits: int = 2, signed: bool = False) -> str:
    """Return a number with the given number of significant digits, without an exponent."""
    return f"{float(f'{value:.{digits}g}'):{'+' if signed else ''}g}"


def deviation(plane: Case, solid: Case, key: str = FORCE) -> Deviation:
    """Return the deviation of one quantity; the errors of both cases are taken as independent."""
    p, s = plane.numbers[key], solid.numbers[key]
    ratio = p / s
    relative = math.hypot(plane.errors.get(key, 0.0) / max(abs(p), 1e-300), solid.errors.get(key, 0.0) / abs(s))
    return Deviation(solid.width_mm, ratio - 1.0, abs(ratio) * relative)


def force_deviation(plane: Case, solid: Case) -> Deviation:
    """Return the deviation of the forces.

    On swept meshes the in-plane error is common to both cases, and the error of their ratio follows from the ratio on
    the companion meshes. The error bar is at least `_COMMON` times that of independent errors, because two changes may
    agree by chance: of 32 deviations of the Fig. 9 finger (nu = 0.3 and 0.49, 10 to 200 mm wide, edges of 3.6 and 5 mm)
    31 are within twice the error bar with this bound, 24 without.
    """
    found = deviation(plane, solid)
    both = plane.companion and solid.companion and (plane.ratio > 1.0) == (solid.ratio > 1.0)
    # Edges of the solid's companion mesh are limited to the width, those of the section's are not.
    if solid.mesher != "swept" or not both or FACTOR * solid.size_mm > solid.width_mm:
        return found
    change = abs(found.value - (plane.companion[FORCE] / solid.companion[FORCE] - 1.0))
    error = change / min(gain(plane.ratio), gain(solid.ratio))
    return Deviation(found.width_mm, found.value, min(found.error, max(error, _COMMON * found.error)))


def crossing_width(found: Sequence[Deviation], narrow: bool) -> tuple[float, float, float] | None:
    """Return the width at which the deviation reaches `WITHIN`, and the ends of its error bar, mm; None if it does not.

    Parameters
    ----------
    found : deviations at several widths
    narrow : whether the model holds for narrow fingers (plane stress) instead of wide ones (plane strain)
    """
    ordered = sorted(found, key=lambda d: d.width_mm)
    width = np.array([d.width_mm for d in ordered])
    value, error = np.array([abs(d.value) for d in ordered]), np.array([d.error for d in ordered])
    # The deviation from plane strain falls as 1/width; that from plane stress grows in proportion to the width.
    scale = width if narrow else 1.0 / width
    at = [_crossing(scale, v, WITHIN) for v in (value, np.maximum(value - error, 0.0), value + error)]
    if at[0] is None:
        return None
    sizes = [float("nan") if a is None else (a if narrow else 1.0 / a) for a in at]
    return sizes[0], sizes[1], sizes[2]


def _crossing(scale: Float, value: Float, limit: float) -> float | None:
    """Return the largest scale up to which the interpolated `value` stays below `limit`; None if there is none."""
    order = np.argsort(scale)
    scale, value = scale[order], value[order]
    if value[0] > limit:
        return None
    for a, b, fa, fb in zip(scale[:-1], scale[1:], value[:-1], value[1:], strict=True):
        if fb > limit:
            return float(a + (b - a) * (limit - fa) / (fb - fa))
    return float(scale[-1])


def verdict(cases: Sequence[Case], own_width_mm: float, height_mm: float, turns: bool = False) -> list[str]:
    """Return the verdict on the solved cases; it names those that did not converge.

    `turns` is whether the object turns out of the plane of the sections.
    """
    failed = [c for c in cases if not c.ok]
    out = [f"{c.model}, {c.width_mm:g} mm wide, has no result: {c.outcome}." for c in failed]
    own = {c.model: c for c in cases if c.ok and c.width_mm == own_width_mm and c.model != "solid"}
    solid = next((c for c in cases if c.ok and c.model == "solid" and c.width_mm == own_width_mm), None)
    planes = [own[name] for name in ("plane strain", "plane stress") if name in own]
    if solid is None or not planes:
        return [*out, "No verdict: the solid and a plane model are needed."]
    out.append(_force(planes, solid, height_mm))
    out += [_width_within(name, cases) for name in ("plane strain", "plane stress")]
    out += _across(solid)
    out += _torsion(solid) if turns else []
    out.append(_sufficient(planes, solid))
    return out


def _force(planes: Sequence[Case], solid: Case, height: float) -> str:
    parts: list[str] = []
    for plane in planes:
        d = deviation(plane, solid)
        verb = "overstates" if d.value > 0.0 else "understates"
        parts.append(f"{plane.model} {verb} {'it' if parts else 'the force'} by {d.text()}")
    text = " and ".join(parts)
    return f"At width/height {solid.width_mm / height:.2g} ({solid.width_mm:g} mm wide, {height:.4g} mm high) {text}."


def _with_error(case: Case, key: str) -> str:
    return with_error(case.numbers[key], case.errors.get(key), digits=4)


def deviations(model: str, cases: Sequence[Case]) -> list[Deviation]:
    """Return the deviations of a plane model from the solids of all widths, each on the same in-plane mesh."""
    found = []
    for solid in cases:
        mesh = model, solid.width_mm, solid.size_mm
        plane = next((c for c in cases if c.ok and (c.model, c.width_mm, c.size_mm) == mesh), None)
        if solid.ok and solid.model == "solid" and plane is not None:
            found.append(force_deviation(plane, solid))
    return sorted(found, key=lambda d: d.width_mm)


def _width_within(name: str, cases: Sequence[Case]) -> str:
    found = deviations(name, cases)
    narrow = name == "plane stress"
    goal, side = f"within {100 * WITHIN:g} % of the solid's force", "up to" if narrow else "from"
    if len(found) < 2:
        return f"{name.capitalize()} was solved at one width only; --widths finds the width at which it is {goal}."
    nearest = found[0] if narrow else found[-1]
    reach = crossing_width(found, narrow)
    widest = f"{rounded(100 * nearest.value, signed=True)} % at {nearest.width_mm:g} mm"
    if reach is None:
        far = "narrowest" if narrow else "widest"
        more = ""
        if not narrow and abs(nearest.value) < _ASYMPTOTIC:
            guess = nearest.width_mm * abs(nearest.value) / WITHIN
            more = f"; extrapolated as 1/width, it does at about {rounded(guess)} mm"
        return f"{name.capitalize()} is not {goal} at any of these widths ({widest}, the {far}){more}."
    at, low, high = reach
    widths = [d.width_mm for d in found]
    if at == (max(widths) if narrow else min(widths)):
        return f"{name.capitalize()} is {goal} at all of these widths, {min(widths):g} to {max(widths):g} mm."
    bar = [f"{v:.3g}" for v in sorted((low, high)) if math.isfinite(v)]
    between = f" (error bar {' to '.join(bar)})" if len(bar) == 2 else ""
    if len(bar) == 1:
        ends = f"less than {min(widths):g} to {bar[0]}" if narrow else f"{bar[0]} to more than {max(widths):g}"
        between = f" (error bar {ends})"
    return f"{name.capitalize()} is {goal} {side} a width of {at:.3g} mm{between}."


def _across(solid: Case) -> list[str]:
    """Return the share of the friction along the width, which no section has."""
    total, across = (solid.numbers[k] for k in ("friction_sum_N_per_mm", "friction_along_z_N_per_mm"))
    if total <= 0.0:
        return []
    return [f"{100 * across / total:.0f} % of the solid's friction sum act along z, where a section has none."]


def numbers_table(cases: Sequence[Case], own_width_mm: float) -> list[list[str]]:
    """Return the numbers of the models at the scene's width with their errors: the head, then a row for each."""
    order = ("solid", "plane strain", "plane stress")
    own = [c for c in cases if c.ok and c.width_mm == own_width_mm and c.model in order]
    own.sort(key=lambda c: order.index(c.model))
    shown = [*SHOWN, *dict.fromkeys(Quantity.of(column) for case in own for column in case.strains)]
    shown = [one for one in shown if any(case.numbers.get(one.name) for case in own)]
    texts = [[_with_error(case, one.name) if one.name in case.numbers else "" for case in own] for one in shown]
    rows = [[one.label, *cells] for one, cells in zip(shown, texts, strict=True)]
    return [["", *(case.model for case in own)], *rows] if rows else []


def _torsion(solid: Case) -> list[str]:
    """Name the moment about the press axis, which no section has."""
    return [
        "The object turns out of the plane of the sections, in which it cannot turn: torsion has no 2D model. Moment "
        f"about the press axis: solid {_with_error(solid, 'moment_y_Nmm_per_mm')} N mm per mm of width, sections none."
    ]


def _sufficient(planes: Sequence[Case], solid: Case) -> str:
    """Name the quantities of each plane model that deviate by more and by less than the limit."""
    names = {
        FORCE: "force",
        "contact_length_mm": "extent of contact",
        "stick_length_mm": "extent of the stick zone",
        "friction_sum_N_per_mm": "friction sum",
        "peak_pressure_MPa": "peak pressure at z = 0",
    }
    names |= {column.key: f"gauge {column.sensor}" for column in solid.strains}
    parts = []
    for plane in planes:
        sides: dict[str, list[str]] = {"more than": [], "less than": [], "not significantly more or less than": []}
        for key, name in names.items():
            if solid.numbers[key] == 0.0:
                continue
            d = deviation(plane, solid, key)
            clear = abs(abs(d.value) - WITHIN) >= _SURE * d.error
            side = "less than" if abs(d.value) < WITHIN else "more than"
            side = side if clear else "not significantly more or less than"
            sides[side].append(f"{name} ({rounded(100 * d.value, signed=True)} %)")
        lists = [f"{side} {100 * WITHIN:g} % in {', '.join(found)}" for side, found in sides.items() if found]
        parts.append(f"{plane.model.capitalize()} deviates from the solid by {'; by '.join(lists)}.")
    return " ".join(parts)


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
        from finger3d.results.summary import FORCE

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
    from finger3d.analyses.free_keys import settled
    from finger3d.scene import scene_of

    report = report or Progress()
    scene = scene_of(scene, overrides)
    tolerance = scene.tables.mesh.tolerance
    if tolerance is not None:
        advice = "press determines them and writes them to the scene.toml of its results, which compare accepts"
        where = f"{scene.path or scene.title}: mesh.tolerance = {tolerance:g}"
        raise Finger3dError(f"{where}: compare needs fixed edge lengths; {advice}")
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
    with suppress(Finger3dError):  # one that takes too much memory has no forecast, and is refused in its turn
        seconds = sum(forecast(variant, bars=True)["total_s"] for _, variant in variants)
        report.say(f"{len(variants)} presses; they take about {duration(seconds)}, --widths sets how many")
    cases: list[Case] = []
    for done, (name, variant) in enumerate(variants, start=1):
        report.stage(f"{name}, {variant.design.width_mm:g} mm wide")
        cases.append(_press(name, variant, model))
        report.step(done, len(variants), _remark(cases[-1]))
        table = numbers_table(cases, model.design.width_mm)
        comparison = Comparison(tuple(cases), tuple(_verdict(model, cases)), tuple(table), folder)
        _write(comparison, solid, model.design.height_mm, complete=done == len(variants))
    from finger3d.plotting.analyses import draw_comparison
    from finger3d.report.analyses import compare_page

    draw_comparison(folder / "compare.png", cases, model.design.width_mm, solid.title)
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
        given = f'finger.geometry = "{model.design.name}" is {lacks_section(model.design)}'
        raise Finger3dError(f"compare: {given}, so there is no 2D model of it; take an extruded design")
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
    for wide in (model, *(widened(model, width) for width in widths)):
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
    found = {
        "scene": scene.as_dict(),
        "outcome": str(comparison.outcome) if complete else _INCOMPLETE,
        "verdict": comparison.verdict,
        "table": comparison.table,
        "within": WITHIN,
        "width_within": {name: _width_entry(told, name == "plane stress") for name, told in by_width.items()},
        "deviation_of_force": {name: [asdict(d) for d in told] for name, told in by_width.items()},
        "cases": [case.as_dict() for case in cases],
        "versions": versions(),
    }
    write_json(folder / "compare.json", found)


def _width_entry(found: Sequence[Deviation], narrow: bool) -> dict[str, float] | None:
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
