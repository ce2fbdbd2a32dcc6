"""What does accuracy cost in time and memory: by element, mesh, increments and solver, beside CalculiX and FElupe?"""

from __future__ import annotations

from . import _cost_of_accuracy, _error_against_time
from ._rows import Result, in_parts

BY_NAME = True


def run(quick: bool) -> Result:
    """Solids and sections by element and solver, then a section beside other programs."""
    return in_parts(quick, _cost_of_accuracy, _error_against_time)
