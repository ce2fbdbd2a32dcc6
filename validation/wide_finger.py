"""Which of the paper's findings are true of the finger 20 mm wide, in small strain and at large deformation, and what
does its section hide?

Source: Maeno 2004; Figs. 3 to 12 are computed in plane stress and plane strain, Sec. IV builds the finger 20 mm wide.
"""

from __future__ import annotations

from . import _fig9_in_3d, _wide_finger_claims
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Sections beside the solid, then the claims of all figures."""
    return in_parts(quick, _fig9_in_3d, _wide_finger_claims)
