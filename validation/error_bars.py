"""Does the true error of a press lie within twice its error bar in nine cases of ten, and are the bars narrow enough to
be of use?"""

from __future__ import annotations

from . import _default_bars, _error_bars
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Bars beside true errors, then their size on default meshes."""
    return in_parts(quick, _error_bars, _default_bars)
