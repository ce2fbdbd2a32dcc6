"""What commands share: the app that they register with, the job, and the scene."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App

import finger3d
from finger3d._machine import reserve_for_linear_algebra
from finger3d.progress import Progress, reporter

if TYPE_CHECKING:
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


def load(path: Path, overrides: list[str] | None, out: Path | None = None) -> Scene:
    """Load a scene with the overrides of --set, and check the output folder with `check_writable`."""
    from finger3d.io import check_writable
    from finger3d.scene import load

    scene = load(path, overrides or [])
    if out is not None:
        check_writable(out, path)
    return scene
