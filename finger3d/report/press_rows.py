"""Numbers of an increment with their errors: the headline of the page of a press, and what the terminal prints."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from finger3d._types import TreeView
from finger3d.accuracy.changes import two_digits
from finger3d.accuracy.error_bars import ErrorBars
from finger3d.errors import Finger3dError, Outcome
from finger3d.mechanics.readings import AREAS, MAIN, SLIP, Kind, Quantity, named
from finger3d.progress import Progress
from finger3d.report.build import HeadlineRow
from finger3d.results.summary import ROUND_OFF, PressStep, grip_rows, read_json, readings_of

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


def _of_model(summary: TreeView, one: Quantity, bars: ErrorBars) -> str:
    """Return what the effects that are off would change, where that is more than the error bar."""
    least, said = bars.totals().get(one.name) or 0.0, []
    for name, changes in summary.get("model_error", {}).items():
        change, low, high = (changes.get(one.name, {}).get(part, 0.0) for part in ("change", "low", "high"))
        if abs(change) > least and low * high > 0.0:
            middle, *ends = (two_digits(one.factor * x) for x in (change, low, high))
            said.append(f"; {name.replace('_', ' ')} {middle} ({' to '.join(ends)})")
    return "".join(said)
