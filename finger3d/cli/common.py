"""What the commands share: the app, refusals before any work, one line of complaint, tables."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

import finger3d
from finger3d._ranges import printable
from finger3d.errors import Finger3dError
from finger3d.progress import Progress, reporter

if TYPE_CHECKING:
    from finger3d.scene import Scene

EPILOGUE = """Examples:

    finger3d new scene.toml
    finger3d plan scene.toml
    finger3d press scene.toml --out out
    finger3d press scene.toml --out out2 --set friction.mu=0.5
    finger3d export scene.toml --out print --mold

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

Json = Annotated[
    bool,
    Parameter(
        name="--json", negative=(), help="JSON alone on standard output, for scripts; all else on standard error."
    ),
]


def reporting(json_: bool) -> tuple[Progress, AbstractContextManager[Any]]:
    """A report for a job, and what to run the job in: with --json all it prints goes to standard error."""
    if json_:
        return reporter(sys.stderr), redirect_stdout(sys.stderr)
    return reporter(), nullcontext()


def print_json(data: Any) -> None:
    """Print for a script; what the terminal cannot encode is escaped."""
    from finger3d.io import json_text

    text = json_text(data)
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        text = json.dumps(json.loads(text), indent=2)
    print(text)


def load(path: Path, overrides: list[str] | None) -> Scene:
    from finger3d.scene import load

    return load(path, overrides or [])


def check_writable(out: Path, scene: Path) -> None:
    """Refuse an output folder that cannot take the results, before any work."""
    if (out / "scene.toml").resolve() == scene.resolve():
        raise Finger3dError(f"--out {out}: holds {scene.name}, which the results would overwrite; name another folder")
    check_folder(out)


def check_folder(out: Path) -> None:
    """Refuse a folder that cannot be written; one that is not there yet is left to those who write into it."""
    try:
        there = next(p for p in (out, *out.parents, Path()) if p.exists())
        if there == out and not out.is_dir():
            raise Finger3dError(f"--out {out}: is a file; name a folder")
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise Finger3dError(f"--out {out}: cannot be written: {error.strerror}") from None


def kept(out: Path, total: int) -> str:
    """Say how many good steps the results hold; what is on disk counts, not what was computed."""
    try:
        steps = json.loads((out / "summary.json").read_text(encoding="utf-8"))["steps"]
    except (OSError, ValueError, KeyError):
        steps = []
    good = sum(step["outcome"] == "converged" for step in steps)
    return f"{good} of {total} steps are kept in {out}" if good else "no step was finished, none is kept"


def complain(text: str) -> None:
    print(f"finger3d: {printable(' '.join(text.split()))}", file=sys.stderr)


def print_rows(title: str, rows: Iterable[tuple[str, Any]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(printable(title), style="bold"), title_justify="left", box=box.SIMPLE, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for key, value in rows:
        table.add_row(Text(printable(key)), Text(printable(str(value))))
    # In a pipe nothing limits the width: a folded path could not be copied.
    width = None if sys.stdout.isatty() else 500
    Console(file=sys.stdout, highlight=False, width=width).print(table)


def print_columns(head: Sequence[str], lines: Iterable[Sequence[str]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE)
    for name in head:
        table.add_column(name, overflow="fold")
    for line in lines:
        table.add_row(*(Text(printable(cell.replace("**", ""))) for cell in line))
    Console(file=sys.stdout, highlight=False, width=None if sys.stdout.isatty() else 240).print(table)
