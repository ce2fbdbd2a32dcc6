"""Does contact pass the benchmarks SSNV104, SSNV128 and SSNV503 of Code_Aster and CGS-1 of NAFEMS?

Source: validation/REFERENCES.md, 6.1 to 6.4.
"""

from __future__ import annotations

from . import _nafems_cgs1, _ssnv104, _ssnv128, _ssnv503
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Two balls, cylinder and block, pushed square, block that is about to slip."""
    return in_parts(quick, _ssnv104, _nafems_cgs1, _ssnv128, _ssnv503)
