"""press, plan, compare: the commands that solve a scene, or tell what solving it will take."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from finger3d.cli.common import Json, Set, app, check_writable, complain, kept, load, print_json, print_rows, reporting
from finger3d.errors import Finger3dError, MissingError
from finger3d.lazy import loading

if TYPE_CHECKING:
    from finger3d.scene import Scene


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
    from finger3d.drawing import Artist

    with Artist(figures, formulae=False) as artist:  # it loads what it needs while the scene is read
        loaded = load(scene, set_)
        check_writable(out, scene)
        with loading():
            import finger3d.ahead  # noqa: F401  all that the job will import
            from finger3d.job import press as run

        report, aside = reporting(json_)
        try:
            with aside, report:
                result = run(loaded, out, report, figures=figures, error=error, artist=artist)
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


@app.command
def plan(scene: Path, /, *, set_: Set = None, json_: Json = False) -> int:
    """Tell which effects are on, how large the model is, and what time and memory it will take; solve nothing.

    Example: finger3d plan scene.toml --set mesh.size_mm=1

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    loaded = load(scene, set_)
    from finger3d.forecast import forecast
    from finger3d.resolution import foreseen
    from finger3d.solve import symmetry

    model = loaded.model()
    expected, warnings = forecast(model), foreseen(model, symmetry(model))
    if loaded.tables.mesh.tolerance is not None:
        expected = {"mesh": f"the first of those refined to tolerance = {loaded.tables.mesh.tolerance:g}"} | expected
    if json_:
        print_json(
            {"title": loaded.title, "effects": loaded.as_dict()["effects"], "forecast": expected, "warnings": warnings}
        )
        return 0
    print_rows("effects", effect_rows(loaded))
    print_rows(loaded.title, [(key.replace("_", " "), value) for key, value in expected.items()])
    for text in warnings:
        print(f"warning: {text}")
    return 0


@app.command
def compare(
    scene: Path,
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder for the results.")],
    widths: Annotated[
        str | None, Parameter(help="Further widths in mm, separated by commas; default 1, 4, 12 and 24 finger heights.")
    ] = None,
    set_: Set = None,
    json_: Json = False,
) -> int:
    """Solve a scene as plane stress, plane strain and solid: would 2D have done, and by how much not?

    Example: finger3d compare scene.toml --out out --widths 5,20,50,200

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    chosen = None if widths is None else [_width(text) for text in widths.split(",")]
    loaded = load(scene, set_)
    if loaded.tables.mesh.tolerance is not None:
        raise Finger3dError(
            f"{scene}: mesh.tolerance = {loaded.tables.mesh.tolerance:g}: compare solves on equal sizes; press finds "
            "them and writes them to its scene.toml, take that one"
        )
    check_writable(out, scene)
    with loading():
        from finger3d.compare import compare as run

    report, aside = reporting(json_)
    try:
        with aside, report:
            result = run(loaded, out, chosen, report)
    except KeyboardInterrupt:
        complain(f"interrupted; {report.steps_done} of {report.steps_total} cases are kept in {out}")
        return 130
    if json_:
        print_json(json.loads((out / "compare.json").read_text(encoding="utf-8")))
    else:
        print("\n".join(result.verdict))
        print(f"results: {out}")
    if result.outcome.ok:
        return 0
    failed = sum(not case.ok for case in result.cases)
    complain(f"{scene}: {failed} of {len(result.cases)} cases gave no numbers: {result.outcome}")
    return MissingError.exit_code


def _width(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise Finger3dError(f"--widths: {text.strip()!r} is no number; give mm and commas: 5,20,50,200") from None


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
            ("stick area", f"{last['stick_area_mm2']:.4g} of {last['contact_area_mm2']:.4g} mm2 of contact"),
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


def effect_rows(scene: Scene) -> list[tuple[str, str]]:
    """Return each known effect with why it is on or off."""
    from finger3d.scene.lookup import effect_names

    def why(name: str) -> str:
        if name not in scene.effects:
            return f"off: the scene has no [effects.{name}]"
        settings = ", ".join(f"{k} = {v}" for k, v in scene.tables.effects[name].items())
        return f"on: [effects.{name}] {settings}"

    return [(name, why(name)) for name in effect_names()]
