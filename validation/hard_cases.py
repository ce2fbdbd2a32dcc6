"""Does contact settle in every case that a user can write, in small strain and at large deformation, with admissible
states?"""

from __future__ import annotations

from . import _hard_cases, _hard_large_deformation
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Small strain, then large deformation."""
    return in_parts(quick, _hard_cases, _hard_large_deformation)
