"""Shared parts of the commands: the app, common options, checks of output folders, progress, and tables."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

import finger3d
from finger3d._machine import reserve_for_linear_algebra
from finger3d._ranges import printable
from finger3d.errors import Finger3dError
from finger3d.progress import Progress, reporter

if TYPE_CHECKING:
    from rich.table import Table

    from finger3d.scene import Scene

EPILOGUE = """Examples:

    finger3d new scene.toml
    finger3d plan scene.toml
    finger3d press scene.toml --out out
    finger3d press scene.toml --out out2 --set friction.mu=0.5
    finger3d export scene.toml --out print --mold

Exit codes: 0 done, 2 bad input, 3 an increment did not converge or something is
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

_LONGEST = 4000
"""Most characters of a message, which may quote what a user has typed."""

Flag = Annotated[bool, Parameter(negative=())]
"""An option without a value and without an opposite."""

Texts = Annotated[list[str], Parameter(negative=())]
"""An option that may be repeated."""

Set = Annotated[
    list[str] | None,
    Parameter(name="--set", negative=(), help="Override a key, for instance friction.mu=0.5; may be repeated."),
]

Json = Annotated[
    bool,
    Parameter(
        name="--json",
        negative=(),
        help="Write only JSON to standard output, for scripts; all other text goes to standard error.",
    ),
]

Out = Annotated[Path, Parameter(help="Folder for the results.")]

Continued = Annotated[Path, Parameter(help="Folder for the results; what was interrupted continues there.")]

Noise = Annotated[float, Parameter(help="Standard deviation of a strain reading; the default is that of Maeno 2004.")]


class Interrupted(Exception):
    """Interruption of a job; the message says which results are kept. Exit code 130."""

    exit_code = 130


@contextmanager
def job(json_: bool, kept: Callable[[Progress], str]) -> Iterator[Progress]:
    """Report the progress of the job in the block.

    Parameters
    ----------
    json_ : print everything in the block to standard error, since standard output is reserved for JSON
    kept : function that describes, after an interruption, which results are kept

    Raises
    ------
    Interrupted
        On Ctrl-C, SIGTERM or SIGHUP.
    """
    report = reporter(sys.stderr if json_ else None)
    reserve_for_linear_algebra()
    try:
        with redirect_stdout(sys.stderr) if json_ else nullcontext(), report:
            yield report
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted; {kept(report)}") from None


def print_json(data: Mapping[str, object] | Sequence[object]) -> None:
    """Print JSON. Characters that standard output cannot encode are escaped."""
    from finger3d.io import json_text

    text = json_text(data)
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        text = json.dumps(json.loads(text), indent=2)
    print(text)


def load(path: Path, overrides: list[str] | None, out: Path | None = None) -> Scene:
    """Load a scene with the overrides of --set, and check the output folder with `check_writable`."""
    from finger3d.scene import load

    scene = load(path, overrides or [])
    if out is not None:
        check_writable(out, path)
    return scene


def check_writable(out: Path, scene: Path) -> None:
    """Raise Finger3dError if the output folder cannot be written, or holds the scene file itself."""
    from finger3d.io import holds  # loads NumPy, which --help can do without

    if holds(out, ["scene.toml"], scene):
        raise Finger3dError(f"--out {out}: holds {scene.name}, which the results would overwrite; name another folder")
    check_folder(out)


def check_folder(out: Path) -> None:
    """Raise Finger3dError if a folder cannot be written, or cannot be created where it does not exist."""
    try:
        # a link that leads nowhere, or in a circle, is there without existing
        there = next(p for p in (out, *out.parents, Path()) if os.path.lexists(p))
        if not there.exists():
            raise Finger3dError(f"--out {out}: {there} is a link that leads nowhere; name another folder")
        if there == out and not out.is_dir():
            raise Finger3dError(f"--out {out}: is a file; name a folder")
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise Finger3dError(f"--out {out}: cannot be written: {error.strerror}") from None


def numbers(option: str, text: str, wanted: str) -> list[float]:
    """Return numbers that are separated by commas; `wanted` is what to give instead of a text that is none."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise Finger3dError(f"{option} {text}: must be {wanted}") from None


def complain(text: str) -> None:
    """Print one line on standard error."""
    line = printable(" ".join(text.split()))
    if len(line) > _LONGEST:
        line = f"{line[: _LONGEST // 2]} ... {line[-_LONGEST // 2 :]}"
    print(f"finger3d: {line}", file=sys.stderr)


def print_rows(title: str, rows: Iterable[tuple[str, object]]) -> None:
    """Print a title and a table of names and values."""
    from rich.text import Text

    bold = Text(printable(title), style="bold")
    table = _table()
    table.title, table.title_justify, table.show_header = bold, "left", False
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for key, value in rows:
        table.add_row(Text(printable(key)), Text(printable(str(value))))
    # Output to a pipe is wide enough for paths, which could not be copied from two lines.
    _print(table, 500)


def print_columns(head: Sequence[str], lines: Iterable[Sequence[str]]) -> None:
    """Print a table with column names."""
    from rich.text import Text

    table = _table()
    for name in head:
        table.add_column(name, overflow="fold")
    for line in lines:
        table.add_row(*(Text(printable(cell.replace("**", ""))) for cell in line))
    _print(table, 240)


def _table() -> Table:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE)


def _print(table: Table, piped_width: int) -> None:
    from rich.console import Console

    Console(file=sys.stdout, highlight=False, width=None if sys.stdout.isatty() else piped_width).print(table)
