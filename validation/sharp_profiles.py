"""Do a flat punch, a wedge, a cone and a wave press as their closed forms say, singular and periodic as they are?

Source: validation/REFERENCES.md, 1.4 to 1.6.
"""

from __future__ import annotations

from . import _flat_punch, _wedge_cone_wave
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Punch, then wedge, cone and wave."""
    return in_parts(quick, _flat_punch, _wedge_cone_wave)
