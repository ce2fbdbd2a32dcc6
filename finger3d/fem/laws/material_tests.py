"""Nominal stress in the usual tests of an incompressible solid, and how far it rises.

The principal stretches have the product 1, and a pressure makes one face free of stress.  With W(l1, l2, l3) the
nominal (first Piola-Kirchhoff) stress along the first axis is ``P = dW/dl1 - l3/l1 dW/dl3 = (t1 - t3) / l1`` with the
Kirchhoff stresses ``t = l dW/dl`` (Treloar 1975, chap. 5; Ogden 1984, sec. 7.2)::

    uniaxial        l, 1/sqrt(l), 1/sqrt(l)
    equibiaxial     l, l, 1/l^2
    pure shear      l, 1, 1/l           of a wide, clamped strip (planar tension)
"""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.base import IsochoricLaw
from finger3d.fem.laws.stability import MODES, least_stiffness

TESTS = {
    "tension": "uniaxial tension",
    "compression": "uniaxial compression",
    "shear": "planar tension",
    "equibiaxial": "equibiaxial tension",
}
"""Tests by mode; shear is pure shear."""

LARGEST_STRETCH, _GRID = 10.0, 461
"""Stretch up to which stresses are followed (in compression its inverse), and number of stretches: 0.5 % apart."""


def principal_stretches(mode: str, stretch: Float) -> Float:
    """Return the principal stretches (..., 3) of a test: along the load first, across a free face last."""
    logs = np.array(MODES[TESTS[mode]])
    return np.asarray(stretch[..., None] ** (logs / logs[0]))


def nominal_stress(law: IsochoricLaw, stretches: Float) -> Float:
    """Return the nominal stress (...,) MPa along the first axis, which leaves the third one free of stress."""
    kirchhoff = law.kirchhoff(stretches)
    return np.asarray((kirchhoff[..., 0] - kirchhoff[..., 2]) / stretches[..., 0])


def rising_to(law: IsochoricLaw, mode: str) -> float:
    """Return the stretch to which a law is stable in a test, from 1, at most `LARGEST_STRETCH`.

    Its nominal stress rises with the stretch, and it satisfies Drucker's postulate (`finger3d.fem.laws.stability`).
    """
    sign = -1.0 if mode == "compression" else 1.0
    stretch = LARGEST_STRETCH ** (sign * np.linspace(0.0, 1.0, _GRID))
    stretches = principal_stretches(mode, stretch)
    rises = sign * np.diff(nominal_stress(law, stretches)) > 0.0
    stable = rises & (least_stiffness(law, stretches)[:-1] > 0.0)
    return float(stretch[_GRID - 1 if stable.all() else stable.argmin()])
