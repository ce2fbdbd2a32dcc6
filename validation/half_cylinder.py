"""How do the fingers of the paper deform, and how do tractions and strains in the half cylinder change with the depth
and with friction?

Source: Maeno 2004, Figs. 2 to 8 and 10.
"""

from __future__ import annotations

from . import _half_cylinder_deformation, _half_cylinder_forces, _half_cylinder_strains
from ._rows import Result, in_parts


def run(quick: bool) -> Result:
    """Deformation, forces and strains."""
    return in_parts(quick, _half_cylinder_deformation, _half_cylinder_forces, _half_cylinder_strains)
