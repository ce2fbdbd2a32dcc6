"""Command line. Each command imports its dependencies when it runs, so that ``finger3d --help`` starts quickly."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from cyclopts import CycloptsError, MissingArgumentError

# Importing a module registers its command.
import finger3d.cli.app  # noqa: F401
from finger3d._extras import absent, message
from finger3d.cli import (  # noqa: F401
    calibrate,
    compare,
    completion,
    estimate,
    export,
    identify,
    info,
    new,
    optimise,
    plan,
    press,
    schema,
    show,
    sweep,
    validate,
)
from finger3d.cli.common import Interrupted, app, complain
from finger3d.cli.terminal import safe_streams, termination_interrupts
from finger3d.errors import OUT_OF_MEMORY, Finger3dError, MissingError, out_of_memory


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Errors are reported in one line on standard error. SIGTERM and SIGHUP interrupt a command like Ctrl-C.
    """
    with safe_streams(), termination_interrupts():
        return _run(arguments)


def _run(arguments: Sequence[str] | None) -> int:
    try:
        return app(arguments, exit_on_error=False, print_error=False) or 0
    except MissingArgumentError as error:
        option = error.argument.name if error.argument else ""
        complain("give --out FOLDER, the folder for the results" if option == "--out" else str(error))
        return Finger3dError.exit_code
    except CycloptsError as error:
        complain(f"{error} (finger3d --help lists the commands and options)")
        return Finger3dError.exit_code
    except (Finger3dError, Interrupted) as error:
        complain(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        complain("interrupted; nothing was written")
        return 130
    except (MemoryError, OSError, RuntimeError) as error:
        if not out_of_memory(error):
            raise
        complain(OUT_OF_MEMORY)
        return MissingError.exit_code
    except ImportError as error:
        if out_of_memory(error):
            complain(OUT_OF_MEMORY)
            return MissingError.exit_code
        if (module := absent(error)) is not None:
            words = sys.argv[1:] if arguments is None else arguments
            complain(message(next(iter(words), "finger3d"), module))
            return MissingError.exit_code
        # The loaders of OCP and VTK turn a KeyboardInterrupt into an ImportError.
        if not isinstance(error.__cause__ or error.__context__, KeyboardInterrupt):
            raise
        complain("interrupted while a package was loading; finished steps are kept")
        return 130
