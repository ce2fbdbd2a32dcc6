"""press: solve a scene."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from finger3d.cli.common import Json, Set, app, check_writable, complain, kept, load, print_json, print_rows, reporting
from finger3d.errors import MissingError


@app.command
def press(
    scene: Path,
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder for the results.")],
    set_: Set = None,
    figures: Annotated[bool, Parameter(negative="--no-figures", help="Draw the pictures.")] = True,
    error: Annotated[
        bool, Parameter(negative="--no-error", help="Estimate errors, from a run on another mesh.")
    ] = True,
    json_: Json = False,
) -> int:
    """Solve a scene: CAD, mesh, contact, results.

    Example: finger3d press scene.toml --out out --set friction.mu=0.5

    Parameters
    ----------
    scene
        The scene file (TOML); `finger3d new` writes one.
    """
    loaded = load(scene, set_)
    check_writable(out, scene)
    from finger3d.analyses.press import press as run

    report, aside = reporting(json_)
    try:
        with aside, report:
            result = run(loaded, out, report, figures=figures, error=error)
    except KeyboardInterrupt:
        complain(f"interrupted; {kept(out, report.steps_total)}")
        return 130
    if json_:
        print_json(result.summary())
    else:
        print_rows(loaded.title, summary_rows(result.summary(), out))
    for kind in ("warnings", "advice"):
        for text in result.summary().get(kind, ()):
            print(f"{kind.removesuffix('s')}: {text}", file=sys.stderr if json_ else sys.stdout)
    if result.outcome.ok:
        return 0
    complain(f"{scene}: {result.summary()['outcome']} ({kept(out, report.steps_total)})")
    return MissingError.exit_code


def summary_rows(summary: Mapping[str, Any], out: Path) -> list[tuple[str, str]]:
    """Return the closing table of a press: what was found in the last step, and where the files are."""
    rows = [("outcome", summary["outcome"])]
    bars = summary.get("error_estimate") or {}
    if summary["steps"]:
        last = summary["steps"][-1]

        def told(name: str, digits: int, times: float = 1.0) -> str:
            return with_error(times * (last | gauges)[name], error_of(bars, name), digits, times)

        gauges = {f"gauge_{name}": strain for name, strain in last["gauges"].items()}
        rows += [
            ("depth", f"{last['depth_mm']:.4g} mm, step {len(summary['steps'])}"),
            ("normal force", f"{told('normal_force_N', 5)} N"),
            ("friction sum", f"{told('friction_sum_N', 5)} N"),
            ("contact length", f"{told('contact_half_length_mm', 4, 2.0)} mm at z = 0"),
            ("stick length", f"{told('stick_half_length_mm', 4, 2.0)} mm at z = 0"),
            ("contact area", f"{told('contact_area_mm2', 4)} mm2"),
            ("stick area", f"{told('stick_area_mm2', 4)} mm2"),
            ("residual", f"{max(s['residual'] for s in summary['steps']):.1e}, the largest of all steps"),
        ]
        rows += [(f"strain {name.removeprefix('gauge_')}", told(name, 5)) for name in gauges]
    if bars and not bars["discretisation"]:
        rows.append(("error", bars["method"]))
    elif bars:
        rows.append(("+-", f"mesh and steps, not the model; estimated in {bars['seconds']:.1f} s; --no-error skips it"))
    if summary.get("cost"):
        rows.append(("time", f"{summary['cost']['seconds']['total']:.1f} s"))
    rows.append(("results", str(out)))
    rows += [("", p.name) for p in sorted(out.iterdir()) if p.is_file() and not p.name.startswith(".")]
    return rows


def error_of(bars: Mapping[str, Any], name: str) -> float | None:
    """Both estimated errors of a number together, None where there is no estimate."""
    if name not in bars.get("discretisation", {}):
        return None
    return float(bars["discretisation"][name] + bars["steps"].get(name, 0.0))


def with_error(value: float, error: float | None, digits: int, times: float = 1.0) -> str:
    """Return a number with its error bar, to the bar's second digit, or to `digits` digits where there is none."""
    if error is None:
        return f"{value:.{digits}g}"
    bar = times * error
    if not bar:
        return f"{value:.{digits}g} +- 0"
    places = min(9, max(0, 1 - math.floor(math.log10(bar))))
    return f"{value:.{places}f} +- {bar:.{places}f}"
