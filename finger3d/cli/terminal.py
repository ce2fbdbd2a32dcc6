"""Descriptors and width of the terminal that a command begins with."""

from __future__ import annotations

import os
import shutil

_LEAST_COLUMNS = 20
"""Width below which cyclopts and rich break lines without end."""


def fill_descriptors() -> None:
    """Open the null device for closed standard descriptors, which the next opened file would otherwise take."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            os.set_inheritable(number, True)


def least_width() -> None:
    """Let text be at least 20 columns wide on a terminal that says it is narrower."""
    said = os.environ.get("COLUMNS", "")
    width = int(said) if said.isdecimal() else shutil.get_terminal_size().columns
    if width < _LEAST_COLUMNS:
        os.environ["COLUMNS"] = str(_LEAST_COLUMNS)
