"""At which order do errors of increments fall, are the paper's small enough, and do automatic ones know how far off
they are?"""

from __future__ import annotations

from . import _increment_errors, _paths
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Orders of errors, then errors beside the exact path."""
    return in_parts(quick, _increment_errors, _paths)
