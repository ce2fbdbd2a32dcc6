"""Elastic energies, of which the package has the derivatives only: of a law, and of a body."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.fem.hyperelastic import TotalLagrangian
from finger3d.fem.laws import IsochoricLaw, MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.laws.base import Inhomogeneous
from finger3d.fem.laws.invariants import InvariantLaw, _invariants
from finger3d.fem.laws.ogden import _principal
from finger3d.fem.tensors import determinant


def energy(law: IsochoricLaw, f: Float) -> Float:
    """The energy (...,) MPa of deformation gradients (..., 3, 3)."""
    if isinstance(law, Inhomogeneous):
        return law.relative * energy(law.law, f)
    if isinstance(law, Ogden):
        return _of_ogden(law, f)
    assert isinstance(law, InvariantLaw)
    x1, x2 = _invariants(f)
    e, half = x1 - 3.0, 0.5 * law.shear
    match law:
        case NeoHooke():
            return half * e
        case MooneyRivlin():
            return half * ((1.0 - law.c01_share) * e + law.c01_share * (x2 - 3.0))
        case Yeoh():
            return half * e * (1.0 + e * (law.c2_over_c1 + e * law.c3_over_c1))
    return law.of_invariants(x1, x2)  # type: ignore[attr-defined]  # a law of the tests


def _of_ogden(law: Ogden, f: Float) -> Float:
    square, _ = _principal(f)
    logs = 0.5 * np.log(square / np.cbrt(determinant(f))[..., None] ** 2)
    logs -= logs.mean(axis=-1, keepdims=True)  # their sum is 0, up to round-off that 1 / a multiplies
    return np.asarray(sum(mu * (a * logs**2 * _second_order(a * logs)).sum(axis=-1) for mu, a in law._constants()))


def _second_order(y: Float) -> Float:
    """(exp(y) - 1 - y) / y^2, 1/2 at y = 0."""
    small = np.abs(y) < 1e-2
    safe = np.where(small, 1.0, y)
    series = 0.5 + y / 6.0 * (1.0 + y / 4.0 * (1.0 + y / 5.0 * (1.0 + y / 6.0 * (1.0 + y / 7.0))))
    return np.asarray(np.where(small, series, (np.expm1(safe) - safe) / safe**2))


def energy_of_body(solid: TotalLagrangian, x: Float) -> float:
    """The elastic energy, mJ, of a body at unknowns x (N,)."""
    material, f = solid.material, solid.deformation(x)
    j, p = determinant(f), solid.pressures(x)
    volumetric = 0.5 * material.bulk * (j - 1.0) ** 2 if p is None else p * (j - 1.0) - 0.5 * p**2 / material.bulk
    return float((energy(material.law, f) + volumetric) @ solid._operators[1].ravel())
