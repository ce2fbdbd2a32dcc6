"""Stability of hyperelastic laws: Drucker's postulate for incompressible deformation.

The Kirchhoff stress must do positive second-order work on any change of the logarithmic strains that keeps the volume
(Hill 1957; Abaqus applies the same test to hyperelastic constants).  In principal directions this is a 2 x 2 matrix.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from finger3d._types import Float
from finger3d.fem.laws.base import IsochoricLaw

MODES = {
    "uniaxial tension": (1.0, -0.5, -0.5),
    "uniaxial compression": (-1.0, 0.5, 0.5),
    "equibiaxial tension": (0.5, 0.5, -1.0),
    "planar tension": (1.0, 0.0, -1.0),
}
"""Logarithmic strains of the usual tests: first that along which the sample is loaded, last one of a free face."""

_ISOCHORIC = np.array([[1.0, 1.0], [-1.0, 1.0], [0.0, -2.0]]) / np.sqrt([2.0, 6.0])
"""Orthonormal basis (3, 2) of the principal strains that keep the volume."""

_LARGEST_STRAIN, _GRID = 3.0, 301
"""Largest logarithmic strain at which a law is checked, and number of strains."""


def least_stiffness(law: IsochoricLaw, stretches: Float) -> Float:
    """Return the smallest stiffness (...,) at principal stretches (..., 3), over that at rest; 0 is the limit."""
    isochoric = stretches / np.cbrt(stretches.prod(axis=-1, keepdims=True))
    derivative = law.principal_stress(isochoric)[1]
    return np.asarray(np.linalg.eigvalsh(_ISOCHORIC.T @ derivative @ _ISOCHORIC)[..., 0] / (2.0 * law.shear))


def unstable_from(law: IsochoricLaw) -> dict[str, float]:
    """Return the nominal strain from which a law is unstable in each of the usual tests; stable tests are left out."""
    out = {}
    strains = np.linspace(0.0, _LARGEST_STRAIN, _GRID)
    for mode, direction in MODES.items():
        axis = np.array(direction) / abs(direction[0])

        def stiffness(strain: float, axis: Float = axis) -> float:
            return float(least_stiffness(law, np.exp(strain * axis)))

        falling = np.flatnonzero(least_stiffness(law, np.exp(strains[:, None] * axis)) <= 0.0)
        if len(falling):
            root = brentq(stiffness, strains[falling[0] - 1], strains[falling[0]]) if falling[0] else 0.0
            out[mode] = float(np.exp(root * axis[0]) - 1.0)
    return out
