"""The closing table of a press: its outcome, and the numbers of its last increment with their errors."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

from finger3d._types import TreeView
from finger3d.accuracy.changes import two_digits
from finger3d.accuracy.error_bars import ErrorBars, with_error
from finger3d.errors import Finger3dError, Outcome
from finger3d.mechanics.readings.columns import AREAS, MAIN, SLIP
from finger3d.mechanics.readings.quantities import Quantity, named
from finger3d.progress import Progress
from finger3d.results.summary import ROUND_OFF, grip_rows, read_json, readings_of

_SIDEWAYS = (
    "tangential_force_x_N", "tangential_force_z_N", "slide_x_mm", "slide_z_mm",
    "turn_x_deg", "turn_y_deg", "turn_z_deg",
)  # fmt: skip
"""Numbers of a path that leaves the press axis; they are printed where they are not 0."""


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
    """Yield the quantities of a step by their titles, with their errors and what effects that are off would change."""

    def number(one: Quantity, value: float) -> str:
        error = bars.total(one.name)
        return with_error(one.factor * value, None if error is None else one.factor * error, sign="+-")

    def line(one: Quantity, value: float) -> str:
        text, by_modulus = f"{number(one, value)} {one.unit}".rstrip(), bars.modulus.get(one.name)
        if by_modulus is not None:
            text += f", +- {one.factor * by_modulus:.2g} {one.unit}".rstrip() + " by the modulus"
        return f"{text} {one.where}".rstrip() + _of_model(summary, one, bars)

    (depth,) = named("depth_mm")
    yield depth.title, f"{line(depth, last[depth.name])}, increment {summary['steps'].index(last) + 1}"
    for one in named(*MAIN, *AREAS, *SLIP):
        yield one.title, line(one, last[one.name])
    for one in named(*_SIDEWAYS):
        if abs(last[one.name]) > ROUND_OFF * (last["friction_sum_N"] if one.unit == "N" else 1.0):
            yield one.title, line(one, last[one.name])
    read = {c: v for c, v in readings_of(last["gauges"], last["markers"], last["taxels"]).items() if v is not None}
    for (kind, sensor), group in groupby(read, key=lambda c: (c.kind, c.sensor)):
        name, columns = f"{'strain' if kind == 'gauge' else kind} {sensor}", list(group)
        several = [Quantity.of(column) for column in columns]
        if len(several) == 1:
            yield name, line(several[0], read[columns[0]])
            continue
        yield name, ", ".join(number(Quantity.of(c), read[c]) for c in columns) + f" {several[0].unit}"
        by_modulus = [bars.modulus.get(one.name, 0.0) for one in several]
        if any(by_modulus):
            yield "", ", ".join(f"+- {error:.2g}" for error in by_modulus) + f" {several[0].unit} by the modulus"


def _of_model(summary: TreeView, one: Quantity, bars: ErrorBars) -> str:
    """Return what the effects that are off would change, where that is more than the error bar."""
    least, said = bars.total(one.name) or 0.0, []
    for name, changes in summary.get("model_error", {}).items():
        change, low, high = (changes.get(one.name, {}).get(part, 0.0) for part in ("change", "low", "high"))
        if abs(change) > least and low * high > 0.0:
            middle, *ends = (two_digits(one.factor * x) for x in (change, low, high))
            said.append(f"; {name.replace('_', ' ')} {middle} ({' to '.join(ends)})")
    return "".join(said)
