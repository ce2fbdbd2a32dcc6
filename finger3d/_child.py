"""Child processes for native libraries that crash or hang: python -m finger3d._child PARENT_PID MODULE FUNCTION.

The child reads an .npz from standard input, calls the function with its arrays, and writes the arrays that it returns
as an .npz to standard output. It leaves no files behind. On Linux it ends with its parent.
"""

from __future__ import annotations

import importlib
import io
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finger3d._machine import child_environment, end_with
from finger3d._types import Array


class ChildError(Exception):
    """A child process crashed, or did not end in time; the message continues the name of what it ran."""


def in_child(function: Callable[..., Mapping[str, ArrayLike]], limit: float, **given: ArrayLike) -> dict[str, Array]:
    """Call a function of a module in a child process and return the arrays that it returns, by name.

    Parameters
    ----------
    function : takes arrays by keyword
    limit : seconds
    given : the function's arguments

    Raises
    ------
    ChildError
        If the process crashes, or does not end in time.
    """
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **given)
    what = [str(os.getpid()), function.__module__, function.__name__]
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-m", "finger3d._child", *what],
            env=child_environment(),
            input=stream.getbuffer(),
            timeout=limit,
            capture_output=True,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise ChildError(f"did not finish within {limit:.0f} s") from error
    if done.returncode < 0:
        name = signal.Signals(-done.returncode).name
        reason = signal.strsignal(-done.returncode)
        raise ChildError(f"crashed ({name}, {reason})")
    if done.returncode != 0:
        said = (done.stderr.decode(errors="replace").strip().splitlines() or ["no message"])[-1]
        raise ChildError(f"crashed (return code {done.returncode}): {said}")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as result:
        return dict(result)


def _answer(module: str, name: str) -> None:
    """Call the function with the arrays of standard input; what libraries print goes to standard error."""
    output = os.dup(1)
    os.dup2(2, 1)
    with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as stored:
        given: dict[str, Any] = dict(stored)
    function = getattr(importlib.import_module(module), name)
    _leave_no_files()
    result = io.BytesIO()
    np.savez(result, allow_pickle=False, **function(**given))
    with os.fdopen(output, "wb") as stream:
        stream.write(result.getbuffer())


def _leave_no_files() -> None:
    """Enter a removed folder, so that libraries cannot write files into the working folder."""
    folder = tempfile.mkdtemp(prefix="finger3d_")
    os.chdir(folder)
    with suppress(PermissionError):  # Windows does not remove the working folder of a process
        os.rmdir(folder)


if __name__ == "__main__":
    end_with(int(sys.argv[1]))
    _answer(*sys.argv[2:])
