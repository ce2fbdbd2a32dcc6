"""Does contact pass the benchmarks SSNV104, SSNV128 and SSNV503 of Code_Aster?

Source: validation/REFERENCES.md, 6.1 to 6.3.  CGS-1 of NAFEMS, of two elastic bodies, is pressed in two_elastic_bodies.
"""

from __future__ import annotations

from . import _ssnv104, _ssnv128, _ssnv503
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Two balls, pushed square, block that is about to slip."""
    return in_parts(quick, _ssnv104, _ssnv128, _ssnv503)
