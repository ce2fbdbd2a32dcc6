"""Does ``effects.auto`` use the effects that a scene needs, and is what a press says of those left out true?"""

from __future__ import annotations

from . import _advice_against_truth, _effects_by_need
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Which effects are used, then what is said of large deformation."""
    return in_parts(quick, _effects_by_need, _advice_against_truth)
