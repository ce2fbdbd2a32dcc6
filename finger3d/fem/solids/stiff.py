"""Stress of parts far stiffer than others, without the round-off of the deformation gradient F = 1 + H."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.fem.tensors import cofactor

STIFF = 1e4
"""Young's modulus, over the least of all parts, from which a part strains so little that every law has the stress
of Hooke's law.  In the round-off of F the forces of a part 1e5 times as stiff as another one are lost."""


def hookean_stress(
    slope: Float, f: Float, p: Float | None, moduli: tuple[Float, Float], past: Float, plane_stress: bool
) -> Float:
    """Return the first Piola-Kirchhoff stress (s, 3, 3) MPa of Hooke's law for the Green-Lagrange strain.

    Parameters
    ----------
    slope, f : (s, d, d), (s, 3, 3) displacement and deformation gradients
    p : (s,) MPa, the pressure of the mixed form; None in the displacement form
    moduli : shear and bulk moduli (s,) MPa
    past : (s, 3, 3) MPa, second Piola-Kirchhoff stress that has relaxed
    """
    shear, bulk = 2.0 * moduli[0], moduli[1]
    h, unit, d = np.zeros_like(f), np.eye(3), slope.shape[-1]
    h[:, :d, :d] = slope
    strain = 0.5 * (h + np.swapaxes(h, 1, 2) + np.swapaxes(h, 1, 2) @ h)
    dilatation = np.trace(strain, axis1=1, axis2=2)
    if plane_stress:
        across = (past[:, 2, 2] + (shear / 3.0 - bulk) * dilatation) / (2.0 / 3.0 * shear + bulk)
        strain[:, 2, 2], dilatation = across, dilatation + across
    second = shear[:, None, None] * (strain - dilatation[:, None, None] / 3.0 * unit) - past
    if p is None:
        return np.asarray(f @ (second + (bulk * dilatation)[:, None, None] * unit))
    return np.asarray(f @ second + p[:, None, None] * cofactor(f))
