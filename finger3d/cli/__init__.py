"""Command line. Each command imports its dependencies when it runs, so that ``finger3d --help`` starts quickly."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from itertools import pairwise
from pathlib import Path

from cyclopts import App, CycloptsError, MissingArgumentError

from finger3d._extras import absent, message
from finger3d._interruption import fill_descriptors, termination_interrupts
from finger3d._machine import enough_address_space
from finger3d.cli.common import Interrupted, app
from finger3d.cli.gone import gone
from finger3d.cli.printing import complain
from finger3d.cli.streams import safe_streams
from finger3d.errors import OUT_OF_MEMORY, Finger3dError, MissingError, out_of_memory
from finger3d.progress import least_width

_COMMANDS = (
    "app_page calibrate compare cost estimate export identify info new optimise plan press sensitivity show sweep"
)
for _command in _COMMANDS.split():
    import_module(f"finger3d.cli.{_command}")  # which registers it


def main(arguments: Sequence[str] | None = None, program: App | None = None) -> int:
    """Run a command line, that of finger3d unless another program is given, and return its exit code.

    Errors are reported in one line on standard error. SIGTERM and SIGHUP interrupt a command like Ctrl-C.
    """
    fill_descriptors()
    least_width()
    with safe_streams(), termination_interrupts():
        return _run(list(sys.argv[1:] if arguments is None else arguments), program or app)


def _check_surroundings(arguments: Sequence[str]) -> None:
    """Raise Finger3dError where a command would end in a traceback, or not at all, before it can say why."""
    for before, word in pairwise(["finger3d", *arguments]):
        if not word or (word.startswith("--") and word.endswith("=")):
            raise Finger3dError(f"the value after {word.rstrip('=') or before} is empty; give one")
    try:
        Path.cwd()
    except FileNotFoundError:
        raise Finger3dError("the working folder has been removed; change into one that exists") from None
    if not enough_address_space():
        raise MissingError(OUT_OF_MEMORY)


def _run(arguments: Sequence[str], program: App) -> int:
    try:
        _check_surroundings(arguments)
        return program(arguments, exit_on_error=False, print_error=False) or 0
    except MissingArgumentError as error:
        no_out = (
            error.argument and error.argument.name == "--out" and not error.unused_tokens
        )  # else it may be misspelt
        complain("give --out FOLDER, the folder for the results" if no_out else str(error))
        return Finger3dError.exit_code
    except CycloptsError as error:
        complain(gone(error, arguments) or f"{error} (finger3d --help lists the commands and options)")
        return Finger3dError.exit_code
    except (Finger3dError, Interrupted) as error:
        complain(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        complain("interrupted; nothing was written")
        return 130
    except (MemoryError, OSError, RuntimeError, ImportError) as error:
        if out_of_memory(error):
            complain(OUT_OF_MEMORY)
            return MissingError.exit_code
        if isinstance(error, ImportError) and (module := absent(error)) is not None:
            complain(message(next(iter(arguments), "finger3d"), module))
            return MissingError.exit_code
        raise
