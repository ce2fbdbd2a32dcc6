"""The command line. Each command imports what it needs, so that ``finger3d --help`` is quick."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, CycloptsError, Parameter

import finger3d
from finger3d.errors import Finger3dError, MissingError
from finger3d.report import reporter

if TYPE_CHECKING:
    from finger3d.scene import Scene

EPILOGUE = """Examples:

    finger3d new scene.toml
    finger3d plan scene.toml
    finger3d press scene.toml --out out
    finger3d press scene.toml --out out2 --set friction.mu=0.5

Exit codes: 0 done, 2 bad input, 3 a step did not converge or something is
missing, 130 interrupted.
"""

app = App(
    name="finger3d",
    help="Press an elastic finger onto an object, with friction, in 3D.",
    help_epilogue=EPILOGUE,
    help_format="plaintext",
    version=lambda: finger3d.__version__,
    suppress_keyboard_interrupt=False,
    result_action="return_value",
)

Set = Annotated[
    list[str] | None,
    Parameter(name="--set", negative=(), help="Override a key, for instance friction.mu=0.5; may be repeated."),
]


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
    loaded = _load(scene, set_)
    _check_writable(out, scene)
    from finger3d.job import press as run

    report = reporter()
    try:
        with report:
            result = run(loaded, out, report, figures=figures)
    except KeyboardInterrupt:
        _complain(f"interrupted; {_kept(out, report.steps_total)}")
        return 130
    _print_rows(loaded.title, summary_rows(result.summary, out))
    for kind in ("warnings", "advice"):
        for text in result.summary.get(kind, ()):
            print(f"{kind.removesuffix('s')}: {text}")
    if result.outcome.ok:
        return 0
    _complain(f"{scene}: {result.outcome} ({_kept(out, report.steps_total)})")
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
    loaded = _load(scene, set_)
    from finger3d.forecast import forecast

    expected = forecast(loaded.model())
    _print_rows("effects", effect_rows(loaded))
    _print_rows(loaded.title, [(key.replace("_", " "), value) for key, value in expected.items()])
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
    loaded = _load(scene, set_)
    _check_writable(out, scene)
    from finger3d.compare import compare as run

    report = reporter()
    try:
        with report:
            result = run(loaded, out, chosen, report)
    except KeyboardInterrupt:
        _complain(f"interrupted; {report.steps_done} of {report.steps_total} cases are kept in {out}")
        return 130
    print("\n".join(result.verdict))
    print(f"results: {out}")
    if result.outcome.ok:
        return 0
    failed = sum(not case.ok for case in result.cases)
    _complain(f"{scene}: {failed} of {len(result.cases)} cases gave no numbers: {result.outcome}")
    return MissingError.exit_code


def _width(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise Finger3dError(f"--widths: {text.strip()!r} is no number; give mm and commas: 5,20,50,200") from None


@app.command
def validate(
    studies: Annotated[list[str] | None, Parameter(negative=())] = None,
    /,
    *,
    quick: Annotated[bool, Parameter(negative=())] = False,
    out: Annotated[Path | None, Parameter(help="Folder for the results instead of validation/.")] = None,
) -> int:
    """Run studies of validation/: does the code reproduce closed forms, other codes, and the paper?

    Without names all studies run, less those whose results are from the sources as they are.

    Example: finger3d validate press_line --quick

    Parameters
    ----------
    studies
        Names of studies.
    quick
        Small meshes and few steps; the committed results are left alone.
    """
    from finger3d import study

    known = study.studies()
    selected = study.chosen(studies or [], known)
    home = next(iter(known.values())).path.parent
    if quick and out is not None and out.resolve() == home:
        raise Finger3dError(f"--out {out}: quick results would overwrite the full ones there; name another folder")
    folder = out or (Path(tempfile.mkdtemp(prefix="finger3d-validate-")) if quick else home)
    _check_folder(folder)
    report = reporter()
    try:
        with report:
            found = study.validate(selected, quick, folder, report, resume=not studies and not quick, known=known)
    except KeyboardInterrupt:
        _complain(f"interrupted; {report.steps_done} of {len(selected)} studies are kept in {folder}")
        return 130
    _print_columns("study what kind reference wanted got error tolerance verdict".split(), study.table(found))
    print(f"results: {folder}")
    failed = [name for name, rows in found.items() if not all(row.passed for row in rows)]
    if not failed:
        return 0
    _complain(f"validate: outside the tolerance: {', '.join(failed)} (see the rows marked FAIL)")
    return MissingError.exit_code


@app.command
def new(file: Path = Path("scene.toml"), /) -> int:
    """Write a commented scene to start from: the paper's Fig. 9 finger.

    Example: finger3d new my_scene.toml

    Parameters
    ----------
    file
        Where to write; a file that is there already is left alone.
    """
    text = resources.files("finger3d").joinpath("new_scene.toml").read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text.replace("scene.toml", str(file)))
    except FileExistsError:
        raise Finger3dError(f"{file}: there already; give another name") from None
    except OSError as error:
        raise Finger3dError(f"{file}: cannot be written: {error.strerror}") from None
    print(f"{file} written; next: finger3d press {file} --out out")
    return 0


@app.command
def info() -> int:
    """Print versions, machine and folders: what a bug report needs."""
    import platform

    from finger3d.design.cache import folder
    from finger3d.fem import pardiso
    from finger3d.versions import cores, memory_bytes, versions

    memory = memory_bytes()
    _print_rows("versions", versions().items())
    _print_rows(
        "machine",
        [
            ("platform", platform.platform()),
            ("cores", cores()),
            ("memory", f"{memory[0] / 1e9:.1f} GB" if memory else "unknown"),
            ("mesh cache", folder()),
            ("PARDISO", "available" if pardiso.available() else "not available; SuperLU is used, which is slower"),
        ],
    )
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; a user's mistake is one line on standard error."""
    try:
        return app(arguments, exit_on_error=False, print_error=False) or 0
    except CycloptsError as error:
        _complain(f"{error} (finger3d --help lists the commands and options)")
        return Finger3dError.exit_code
    except Finger3dError as error:
        _complain(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        _complain("interrupted; nothing was written")
        return 130


def _complain(text: str) -> None:
    print(f"finger3d: {' '.join(text.split())}", file=sys.stderr)


def _load(path: Path, overrides: list[str] | None) -> Scene:
    from finger3d.scene import load

    return load(path, overrides or [])


def _check_writable(out: Path, scene: Path) -> None:
    """Refuse an output folder that cannot take the results, before any work."""
    if (out / "scene.toml").resolve() == scene.resolve():
        raise Finger3dError(f"--out {out}: holds {scene.name}, which the results would overwrite; name another folder")
    _check_folder(out)


def _check_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except FileExistsError:
        raise Finger3dError(f"--out {out}: is a file; name a folder") from None
    except OSError as error:
        raise Finger3dError(f"--out {out}: cannot be written: {error.strerror}") from None


def _kept(out: Path, total: int) -> str:
    """Say how many good steps the results hold; what is on disk counts, not what was computed."""
    try:
        steps = json.loads((out / "summary.json").read_text(encoding="utf-8"))["steps"]
    except (OSError, ValueError, KeyError):
        steps = []
    good = sum(step["outcome"] == "converged" for step in steps)
    return f"{good} of {total} steps are kept in {out}" if good else "no step was finished, none is kept"


def _print_rows(title: str, rows: Iterable[tuple[str, Any]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(title, style="bold"), title_justify="left", box=box.SIMPLE, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for key, value in rows:
        table.add_row(Text(key), Text(str(value)))
    # In a pipe nothing limits the width: a folded path could not be copied.
    width = None if sys.stdout.isatty() else 500
    Console(highlight=False, width=width).print(table)


def _print_columns(head: Sequence[str], lines: Iterable[Sequence[str]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE)
    for name in head:
        table.add_column(name, overflow="fold")
    for line in lines:
        table.add_row(*(Text(cell.replace("**", "")) for cell in line))
    Console(highlight=False, width=None if sys.stdout.isatty() else 240).print(table)


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
