"""press, plan, compare: the commands that solve a scene, or tell what solving it will take."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from finger3d.cli.common import Set, app, check_writable, complain, kept, load, print_rows
from finger3d.errors import Finger3dError, MissingError
from finger3d.report import reporter

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
    from finger3d.job import press as run

    report = reporter()
    try:
        with report:
            result = run(loaded, out, report, figures=figures)
    except KeyboardInterrupt:
        complain(f"interrupted; {kept(out, report.steps_total)}")
        return 130
    print_rows(loaded.title, summary_rows(result.summary, out))
    for kind in ("warnings", "advice"):
        for text in result.summary.get(kind, ()):
            print(f"{kind.removesuffix('s')}: {text}")
    if result.outcome.ok:
        return 0
    complain(f"{scene}: {result.outcome} ({kept(out, report.steps_total)})")
    return MissingError.exit_code


@app.command
def plan(scene: Path, /, *, set_: Set = None) -> int:
    """Tell which effects are on, how large the model is, and what time and memory it will take; solve nothing.

    Example: finger3d plan scene.toml --set mesh.size_mm=1

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    loaded = load(scene, set_)
    from finger3d.forecast import forecast

    expected = forecast(loaded.model())
    print_rows("effects", effect_rows(loaded))
    print_rows(loaded.title, [(key.replace("_", " "), value) for key, value in expected.items()])
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
    check_writable(out, scene)
    from finger3d.compare import compare as run

    report = reporter()
    try:
        with report:
            result = run(loaded, out, chosen, report)
    except KeyboardInterrupt:
        complain(f"interrupted; {report.steps_done} of {report.steps_total} cases are kept in {out}")
        return 130
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
    if summary["steps"]:
        last = summary["steps"][-1]
        rows += [
            ("depth", f"{last['depth_mm']:.4g} mm, step {len(summary['steps'])}"),
            ("normal force", f"{last['normal_force_N']:.5g} N"),
            ("contact length", f"{2.0 * last['contact_half_length_mm']:.4g} mm at z = 0"),
            ("stick length", f"{2.0 * last['stick_half_length_mm']:.4g} mm at z = 0"),
            ("residual", f"{max(s['residual'] for s in summary['steps']):.1e}, the largest of all steps"),
        ]
        rows += [(f"strain {name}", f"{strain:.5g}") for name, strain in last["gauges"].items()]
    if summary.get("cost"):
        rows.append(("time", f"{summary['cost']['seconds']['total']:.1f} s"))
    rows.append(("results", str(out)))
    rows += [("", p.name) for p in sorted(out.iterdir()) if p.is_file()]
    return rows


def effect_rows(scene: Scene) -> list[tuple[str, str]]:
    """Return each known effect with why it is on or off."""
    from finger3d.scene.lookup import effect_names

    def why(name: str) -> str:
        if name not in scene.effects:
            return f"off: the scene has no [effects.{name}]"
        settings = ", ".join(f"{k} = {v}" for k, v in scene.tables.effects[name].items())
        return f"on: [effects.{name}] {settings}"

    return [(name, why(name)) for name in effect_names()]
