"""Child processes that import this package and end with their parent."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from pathlib import Path

_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def child_environment() -> dict[str, str]:
    """Return the environment of this process, changed so that a child imports this same package."""
    here = str(Path(__file__).resolve().parent.parent)
    path = os.pathsep.join(p for p in (here, os.environ.get("PYTHONPATH")) if p)
    return {**os.environ, "PYTHONPATH": path}


def end_with(parent: int) -> None:
    """Let the kernel kill this process when its parent ends for whatever reason; Linux only.

    A thread could not watch the parent: meshing holds Python's global interpreter lock.

    Parameters
    ----------
    parent : process id of the parent
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # the parent ended before the call
            os._exit(1)
