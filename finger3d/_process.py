"""Child processes that import this very package, and end with their parent."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from pathlib import Path

_PR_SET_PDEATHSIG = 1


def child_environment() -> dict[str, str]:
    """This process's environment, in which a child imports this very package."""
    here = str(Path(__file__).resolve().parent.parent)
    path = os.pathsep.join(p for p in (here, os.environ.get("PYTHONPATH")) if p)
    return {**os.environ, "PYTHONPATH": path}


def end_with(parent: int) -> None:
    """Have the kernel kill this process as soon as its parent has ended, by whatever cause; Linux only.

    A library that computes for long holds Python's lock, so that no thread of Python could watch the parent.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before the call
            os._exit(1)
