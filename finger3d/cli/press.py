"""Command ``press``: the solution of a scene."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from finger3d.cli.common import Json, Set, app, job, load, print_json, print_rows
from finger3d.errors import Finger3dError, MissingError, Outcome

if TYPE_CHECKING:
    from finger3d._types import TreeView
    from finger3d.progress import Progress


@app.command
def press(
    scene: Path,
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder for the results.")],
    set_: Set = None,
    figures: Annotated[bool, Parameter(negative="--no-figures", help="Draw the pictures.")] = True,
    error: Annotated[
        bool, Parameter(negative="--no-error", help="Estimate the errors due to the mesh and the increments.")
    ] = True,
    json_: Json = False,
) -> None:
    """Solve a scene: geometry, mesh, frictional contact, results.

    Example: finger3d press scene.toml --out out --set friction.mu=0.5

    Parameters
    ----------
    scene
        The scene file (TOML); `finger3d new` writes one.
    """
    begin = time.perf_counter()
    loaded = load(scene, set_, out)
    from finger3d.analyses.press import press as run
    from finger3d.scene.derived import moduli

    with job(json_, lambda report: _kept(out, report)) as report:
        result = run(loaded, out, report, figures=figures, error=error)
    summary = result.summary()
    if json_:
        print_json(summary)
    else:
        print_rows(loaded.title, [*moduli(loaded.tables).items(), *_rows(summary, out, time.perf_counter() - begin)])
    for kind in ("warnings", "advice"):
        for text in summary.get(kind, ()):
            print(f"{kind.removesuffix('s')}: {text}", file=sys.stderr if json_ else sys.stdout)
    if not result.outcome.ok:
        raise MissingError(f"{scene}: {summary['outcome']} ({_kept(out, report)})")


def _kept(out: Path, report: Progress) -> str:
    """Return how many converged steps are in the files; those of an earlier press do not count."""
    from finger3d.results.summary import read_json

    try:
        steps = read_json(out / "summary.json")["steps"] if report.steps_done else []
    except (Finger3dError, KeyError):
        steps = []
    good = sum(step["outcome"] == "converged" for step in steps)
    return (
        f"{good} of {report.steps_total} increments are kept in {out}"
        if good
        else "no increment was finished, none is kept"
    )


_NUMBERS = {
    "normal force": ("normal_force_N", 1.0, 5, " N"),
    "friction sum": ("friction_sum_N", 1.0, 5, " N"),
    "contact extent": ("contact_half_length_mm", 2.0, 4, " mm at z = 0"),
    "stick extent": ("stick_half_length_mm", 2.0, 4, " mm at z = 0"),
    "contact area": ("contact_area_mm2", 1.0, 4, " mm2"),
    "stick area": ("stick_area_mm2", 1.0, 4, " mm2"),
}
"""Name of a row -> key of a step, factor, significant digits, unit."""


def _rows(summary: TreeView, out: Path, seconds: float) -> Iterator[tuple[str, str]]:
    """Yield the rows of the closing table: numbers of the last step that converged, with their errors, and files."""
    from finger3d.accuracy.changes import two_digits
    from finger3d.accuracy.error_bars import ErrorBars, with_error
    from finger3d.results.summary import readings_of

    bars, estimate = ErrorBars.of_summary(summary), summary.get("error_estimate")
    steps = [step for step in summary["steps"] if step["outcome"] == str(Outcome.CONVERGED)]

    def number(value: float, key: str, digits: int, factor: float = 1.0) -> str:
        error = bars.total(key)
        return with_error(factor * value, None if error is None else factor * error, digits, "+-")

    def of_model(key: str, factor: float = 1.0) -> str:
        """Return what the effects that are off would change, where that is more than the error bar."""
        least, said = bars.total(key) or 0.0, []
        for name, changes in summary.get("model_error", {}).items():
            change, low, high = (changes.get(key, {}).get(part, 0.0) for part in ("change", "low", "high"))
            if abs(change) > least and low * high > 0.0:
                middle, *ends = (two_digits(factor * x) for x in (change, low, high))
                said.append(f"; {name.replace('_', ' ')} {middle} ({' to '.join(ends)})")
        return "".join(said)

    def of_modulus(key: str, unit: str, factor: float = 1.0) -> str:
        error = bars.modulus.get(key)
        return "" if error is None else f", +- {factor * error:.2g}{unit} by the modulus"

    yield "outcome", summary["outcome"]
    for name, one in ((summary.get("effects_auto") or {}).get("judged") or {}).items():
        yield name.replace("_", " "), f"{'used' if one['used'] else 'not used'}: {one['why']}"
    if steps:
        last = steps[-1]
        depth = number(last["depth_mm"], "depth_mm", 4) + " mm" + of_modulus("depth_mm", " mm")
        yield "depth", f"{depth}, increment {summary['steps'].index(last) + 1}"
        for name, (key, factor, digits, unit) in _NUMBERS.items():
            text = number(last[key], key, digits, factor) + unit + of_modulus(key, unit.split(" at ")[0], factor)
            yield name, text + of_model(key, factor)
        yield "residual", f"{max(step['residual'] for step in steps):.1e}, the largest of all increments"
        readings = readings_of(last["gauges"], last["markers"], last["taxels"])
        for (kind, sensor), group in groupby(readings, key=lambda c: (c.kind, c.sensor)):
            columns = list(group)
            key, unit = columns[0].key, f" {columns[0].unit}".rstrip()
            text = ", ".join(number(value, c.key, 5) for c in columns if (value := readings[c]) is not None) + unit
            by_modulus = [bars.modulus.get(c.key, 0.0) for c in columns]
            name = f"{'strain' if kind == 'gauge' else kind} {sensor}"
            yield name, text if len(columns) > 1 else text + of_modulus(key, unit) + of_model(key)
            if len(columns) > 1 and any(by_modulus):
                yield "", ", ".join(f"+- {error:.2g}" for error in by_modulus) + f"{unit} by the modulus"
    if bars.discretisation:
        yield "+-", f"{bars.covered}, not of the model; estimated in {bars.seconds:.1f} s; smaller ones: finger3d cost"
    if estimate and not (bars.discretisation and bars.steps):
        yield "error", bars.method
    yield "time", f"{seconds:.1f} s, with imports, pictures and page"
    yield "results", str(out)
    for path in sorted(out.iterdir()):
        if path.is_file() and not path.name.startswith("."):
            yield "", path.name
