"""Page of a press, and the numbers of an increment with their errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from finger3d._types import TreeView
from finger3d.accuracy.changes import two_digits
from finger3d.accuracy.error_bars import ErrorBars
from finger3d.contact.conditions import TOLERANCE
from finger3d.contact.friction import OPEN, STATUS_NAMES
from finger3d.errors import Finger3dError, Outcome
from finger3d.mechanics.readings import AREAS, MAIN, MEASURED, OF_INCREMENT, SLIP, Kind, Quantity, named
from finger3d.progress import Progress
from finger3d.report.build import Figure, HeadlineRow, Page, PageSection, Part, Table, how_modelled, view_of
from finger3d.results.states import States, load_states
from finger3d.results.summary import (
    ROUND_OFF,
    PressStep,
    gauges_of,
    grip_rows,
    read_json,
    readings_of,
    steps_of,
    title_of,
)

_HEADLINE = named(*MAIN, "tangential_force_x_N", *AREAS, *SLIP, "external_work_mJ", "dissipation_mJ")

_SIDEWAYS = (
    "tangential_force_x_N", "tangential_force_z_N", "slide_x_mm", "slide_z_mm",
    "turn_x_deg", "turn_y_deg", "turn_z_deg",
)  # fmt: skip
"""Numbers of a path that leaves the press axis; they are printed where they are not 0."""


def row_of(one: Quantity, value: float | None, bars: ErrorBars) -> HeadlineRow:
    """Return a number with its errors of mesh and increments, and of the modulus if that is not given."""
    error, spread = bars.totals().get(one.name), bars.modulus.get(one.name)
    unit = spelt(one.unit)
    if spread is not None:
        unit = f"{unit}, ± {one.factor * spread:.2g} {unit}".rstrip().removeprefix(", ") + " by the modulus"
    shown = "unknown" if value is None else one.factor * value
    return HeadlineRow(f"{one.title} {one.where}".rstrip(), shown, unit, None if error is None else one.factor * error)


def headline(step: PressStep, bars: ErrorBars) -> list[HeadlineRow]:
    """Return the main numbers of a step with their errors, without a tangential force of the size of round-off."""
    numbers = {one: getattr(step, one.name) for one in (*named("depth_mm"), *_HEADLINE)}
    least = ROUND_OFF * max(step.friction_sum_N, 1e-300)
    rows = [
        row_of(one, value, bars)
        for one, value in numbers.items()
        if (one.kind is not Kind.DEPTH or bars.totals().get(one.name) is not None)
        and (one.kind is not Kind.FORCE or abs(value) > least)
    ]
    read = step.readings.items()  # a displacement that is zero by symmetry is left out
    return rows + [row_of(Quantity.of(c), value, bars) for c, value in read if value != 0.0 or c.kind != "marker"]


def slip_rows(summary: TreeView) -> Iterator[HeadlineRow]:
    """Yield the pose of the first slip of the contact and that of gross slip, as far as it is not 0 or fixed there."""
    events = {"first slip": summary.get("first_slip", {}).get("whole"), "gross slip": summary.get("gross_slip")}
    for title, event in events.items():
        errors = event.get("error", {}) if event else {}
        for one in named("depth_mm", *_SIDEWAYS[2:]) if event else ():
            if one.name in errors or (event[one.name] and not errors):
                row = row_of(one, event[one.name], ErrorBars(discretisation=errors))
                yield replace(row, name=f"{title}, {row.name}")


def spelt(text: str) -> str:
    """Return a text with units as they are printed."""
    return text.replace("mm2", "mm²").replace("Nmm", "N mm")


def increments_kept(folder: Path, report: Progress) -> str:
    """Return how many converged increments the files of a press have; those of an earlier press do not count."""
    try:
        steps = read_json(folder / "summary.json")["steps"] if report.steps_done else []
    except (Finger3dError, KeyError):
        steps = []
    good = sum(step["outcome"] == "converged" for step in steps)
    return f"{good} of {report.steps_total} increments are kept in {folder}" if good else "no increment was finished"


def press_rows(summary: TreeView) -> Iterator[tuple[str, str]]:
    """Yield the rows of the table: the numbers are those of the last increment that converged."""
    bars, estimate = ErrorBars.of_summary(summary), summary.get("error_estimate")
    steps = [step for step in summary["steps"] if step["outcome"] == str(Outcome.CONVERGED)]
    yield "outcome", summary["outcome"]
    for name, one in ((summary.get("effects_auto") or {}).get("judged") or {}).items():
        yield name.replace("_", " "), f"{'used' if one['used'] else 'not used'}: {one['why']}"
    yield from grip_rows(summary)
    if steps:
        yield from _numbers(summary, steps[-1], bars)
        yield "residual", f"{max(step['residual'] for step in steps):.1e}, the largest of all increments"
    if bars.discretisation:
        yield "+-", f"{bars.covered}, not of the model; estimated in {bars.seconds:.1f} s; smaller ones: finger3d cost"
    if estimate and not (bars.discretisation and bars.steps):
        yield "error", bars.method


def _numbers(summary: TreeView, last: TreeView, bars: ErrorBars) -> Iterator[tuple[str, str]]:
    """Yield the numbers of a step with their errors and what effects that are off would change."""
    (depth,) = named("depth_mm")
    yield depth.title, f"{row_of(depth, last[depth.name], bars).text}, increment {summary['steps'].index(last) + 1}"
    numbers = {one: last[one.name] for one in named(*MAIN, *AREAS, *SLIP)}
    for one in named(*_SIDEWAYS):
        if abs(last[one.name]) > ROUND_OFF * (last["friction_sum_N"] if one.unit == "N" else 1.0):
            numbers[one] = last[one.name]
    read = readings_of(last["gauges"], last["markers"], last["taxels"])
    numbers |= {Quantity.of(column): value for column, value in read.items() if value is not None}
    for one, value in numbers.items():
        row = row_of(one, value, bars)
        yield row.name, row.text + _of_model(summary, one, bars)
    yield from ((row.name, row.text) for row in slip_rows(summary))


def _of_model(summary: TreeView, one: Quantity, bars: ErrorBars) -> str:
    """Return what the effects that are off would change, where that is more than the error bar."""
    least, said = bars.totals().get(one.name) or 0.0, []
    for name, changes in summary.get("model_error", {}).items():
        change, low, high = (changes.get(one.name, {}).get(part, 0.0) for part in ("change", "low", "high"))
        if abs(change) > least and low * high > 0.0:
            middle, *ends = (two_digits(one.factor * x) for x in (change, low, high))
            said.append(f"; {name.replace('_', ' ')} {middle} ({' to '.join(ends)})")
    return "".join(said)


_PICTURES = {
    "finger.png": "Deformed finger to scale: contact pressure, and stick and slip zones",
    "contact.png": "Traction on the finger along x, with the friction limit and the stick and slip zones",
    "markers.png": "Displacements of the markers",
    "force.png": "Forces, and half the extents of contact and stick zone along x, against depth and slides",
}

_UNTABLED = "force_y_N", "external_work_mJ", "outward_friction_x_N", "outward_friction_z_N"
_OF_STEPS = tuple(one for one in OF_INCREMENT if one.factor == 1.0 and one.name not in _UNTABLED)
"""Quantities in the table of steps."""

_OF_GRIP = (
    "The numbers above, their errors, and the tables below are those of the lower finger. The object's pose is that of "
    "its centre of mass, from where it touched both fingers first. Contact between the fingers is not modelled."
)

_ROUND_OFF = 1e-9  # magnitude of round-off, relative to the force that a number is compared with


def press_page(folder: str | Path) -> Page:
    """Return the page of a press, from the files in its folder.

    The file summary.json is required. The 3D view of a solid needs steps.npz; scene.toml and pictures are optional.

    Raises
    ------
    Finger3dError
        If summary.json cannot be read.
    """
    folder = Path(folder)
    summary = read_json(folder / "summary.json")
    steps = steps_of(summary)
    bars = ErrorBars.of_summary(summary)
    good = [step for step in steps if step.outcome == "converged"]
    source = folder / "steps.npz"
    states = load_states(source) if source.exists() else None
    last = f" after increment {steps.index(good[-1]) + 1}, {good[-1].depth_mm:.4g} mm deep" if good else ""
    grip = PageSection("Two fingers", [_OF_GRIP, Table(("", ""), [*grip_rows(summary)])])
    sections = [
        PageSection("Scene", how_modelled(summary, folder)),
        *([grip] if "fingers" in summary else []),
        *([_proof(steps, states, good)] if steps else []),
        *([_error_bars(bars)] if summary.get("error_estimate") else []),
        *_changes(summary),
        *([_steps(good)] if good else []),
        PageSection("Mesh and cost", [_mesh(summary["mesh"]), _cost(summary["cost"])]),
    ]
    return Page(
        title_of(summary["scene"]),
        [*headline(good[-1], bars), *slip_rows(summary)] if good else (),
        sections,
        [Figure(name, text) for name, text in _PICTURES.items()],
        view_of(states, gauges_of(summary["scene"])) if states else None,
        command="press",
        outcome=f"{summary['outcome']}{last if summary['outcome'] == 'converged' else ''}",
        good=summary["outcome"] == "converged",
        notes=[*summary["warnings"], *summary["advice"], *([_remark(bars)] if bars.discretisation else [])],
        versions=summary["versions"],
    )


def _remark(bars: ErrorBars) -> str:
    """Return what the number after ± is."""
    covered = bars.covered.replace("steps", "increments")
    return f"The number after ± is the {covered}; it does not include the error of the model."


def _error_bars(bars: ErrorBars) -> PageSection:
    """Return the contributions of mesh and increments to each error, and the method of estimation."""
    parts = {"of the mesh": bars.discretisation, "of the increments": bars.steps, "of the modulus": bars.modulus}
    parts = {head: errors for head, errors in parts.items() if errors}
    names = dict.fromkeys(name for errors in parts.values() for name in errors)
    rows = [(name, *(errors.get(name) for errors in parts.values())) for name in names]
    table = [Table(("error, in the unit of the name", *parts), rows)] if rows else []
    said = "The number after ± is the sum of the errors of mesh and increments. "
    if bars.modulus:
        said += "The error of the modulus, one standard deviation, stands apart. "
    return PageSection("Error bars", [f"{said}Method: {bars.method}", *table])


def _changes(summary: TreeView) -> list[PageSection]:
    """Return which effects the scene calls for, if it left that open, and what those that are off would change."""
    out = []
    if need := summary.get("effects_auto"):
        rows = [(name, "used" if one["used"] else "not used", one["why"]) for name, one in need["judged"].items()]
        rows += [(name, "not judged", why) for name, why in need["not_judged"].items()]
        text = (
            f"An effect is used if it changes a number by more than {100.0 * need['tolerance']:g} % of its natural "
            "scale, or if that is not known."
        )
        out.append(PageSection("Effects", [text, Table(("effect", "used", "why"), rows)]))
    for name, changes in summary.get("model_error", {}).items():
        if changes:
            changed = [(key, c["change"], c["low"], c["high"]) for key, c in changes.items()]
            head = ("number, in the unit of its name", "change", "from", "to")
            text = f"Estimated from {summary['model_error_methods'][name]}."
            title = f"Model error: what {name.replace('_', ' ')} would change"
            out.append(PageSection(title, [text, Table(head, changed)], folded=True))
    return out


def _proof(steps: Sequence[PressStep], states: States | None, good: Sequence[PressStep]) -> PageSection:
    """Return the residuals of the contact conditions of every step, and the extreme values of the last state."""
    worst = max((s.residual for s in good if s.residual is not None), default=None)
    parts: list[Part] = [
        "Every contact point is open (gap > 0, no force) or closed (gap = 0, pressure > 0). A closed point sticks (no "
        "slip, |friction| at most mu times pressure) or slips (|friction| = mu times pressure, opposite to the slip): "
        "Eqs. (1)-(4) of Maeno 2004, and friction opposes slip. All conditions are checked after every increment. The "
        "residual is the largest violation, relative to the depth for gaps and slips, and to the largest nodal "
        f"force for forces. An increment has converged only if its residual is at most {TOLERANCE:g}."
    ]
    if worst is not None:
        parts.append(f"Largest residual of the {len(good)} converged increments: {worst:.1e}.")
    if states is not None:
        parts.append(_last_state(states))
    rows = []
    for k, step in enumerate(steps, start=1):
        residual = "none" if step.residual is None else f"{step.residual:.1e}"
        holds = "yes" if step.residual is not None and step.residual <= TOLERANCE else "NO"
        rows.append((k, step.depth_mm, residual, holds, step.iterations, step.method, step.outcome))
    head = ("increment", "depth (mm)", "residual", f"≤ {TOLERANCE:g}", "iterations", "method", "outcome")
    return PageSection("Proof of the contact conditions", [*parts, Table(head, rows)])


def _last_state(states: States) -> Table:
    """Return the number of points in each state and the extreme gaps and pressures of the last step."""
    status, gap, pressure = states.status[-1], states.gap[-1], states.pressure[-1]
    closed = status != OPEN
    rows: list[tuple[str, object, str]] = [
        (f"points that are {name}", int(np.count_nonzero(status == k)), "") for k, name in enumerate(STATUS_NAMES)
    ]
    if (~closed).any():
        rows.append(("smallest gap of an open point", float(gap[~closed].min()), "mm, ≥ 0"))
        rows.append(("largest pressure on an open point", float(np.abs(pressure[~closed]).max()), "MPa, = 0"))
    if closed.any():
        rows.append(("largest |gap| of a closed point", float(np.abs(gap[closed]).max()), "mm, = 0"))
        rows.append(("smallest pressure on a closed point", float(pressure[closed].min()), "MPa, ≥ 0"))
    return Table(("in the last increment", "", ""), rows)


def _steps(good: Sequence[PressStep]) -> PageSection:
    """Return a table of the converged steps; columns of the size of round-off are omitted."""
    scale = max(abs(step.normal_force_N) for step in good)
    # For instance the tangential force of a symmetric press, and slides of a path without them.
    shown = [
        one
        for one in _OF_STEPS
        if one.name == "depth_mm" or max(abs(getattr(s, one.name)) for s in good) > _ROUND_OFF * scale
    ]
    columns = [column for column in good[-1].readings if not column.axis]
    rows = [[*(getattr(s, one.name) for one in shown), *(s.readings.get(c) for c in columns)] for s in good]
    names = [f"{MEASURED[c.kind]} {c.sensor}{c.unit and f' ({c.unit})'}" for c in columns]
    table = Table([*(spelt(one.label) for one in shown), *names], rows)
    told = "The file history.csv has these numbers, and more, with all digits."
    return PageSection("Every increment", [told, table], folded=True)


def _mesh(mesh: TreeView) -> Table:
    part = f"the part that is symmetric in {' and '.join(mesh['symmetry'])}" if mesh["symmetry"] else "the whole"
    rows: list[tuple[str, object]] = [
        ("finger", mesh.get("finger", "unknown")),
        ("nodes, cells", f"{mesh['points']}, {mesh['cells']}"),
        ("unknowns", str(mesh["dofs"])),
        ("contact points", str(mesh["contact_points"])),
        ("elements", mesh["formulation"]),
        ("solved on", part),
        ("smallest dihedral angle", f"{_digits(mesh['min_dihedral_deg'])} deg"),
        ("volume of mesh, of CAD", f"{mesh['volume_mm3']:.6g}, {_digits(mesh['cad_volume_mm3'])} mm³"),
        ("hash", f"{mesh['hash']}{', from the cache' if mesh['from_cache'] else ''}"),
    ]
    return Table(("mesh", ""), rows)


def _digits(value: float | None) -> str:
    return "none" if value is None else f"{value:.6g}"


def _cost(cost: TreeView) -> Table:
    seconds = cost["seconds"]
    rows: list[tuple[str, object]] = [(stage, f"{s:.2f} s") for stage, s in seconds.items()]
    rows += [
        ("factorisations", f"{cost['factorizations']}, by {cost.get('solver', 'unknown')}"),
        ("peak memory", "unknown" if cost["peak_memory_MB"] is None else f"{cost['peak_memory_MB']:.0f} MB"),
    ]
    return Table(("cost", ""), rows)
