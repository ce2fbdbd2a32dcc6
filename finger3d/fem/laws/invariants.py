"""Laws that depend on the isochoric invariants I1 = tr C, I2 = (I1^2 - tr C^2) / 2 of ``J^(-1/3) F``.

With X1 = J^(-2/3) I1 and X2 = J^(-4/3) I2 the stress is ``W_1 dX1/dF + W_2 dX2/dF`` (Holzapfel 2000, secs. 6.4, 6.5).

Polynomials of the invariants are the laws of neo-Hooke, Mooney and Rivlin, and Yeoh, with the shear modulus G::

    neo-Hooke        W = G/2 (I1 - 3)
    Mooney-Rivlin    W = c10 (I1 - 3) + c01 (I2 - 3),           2 (c10 + c01) = G
    Yeoh             W = sum of c_i (I1 - 3)^i, i = 1, 2, 3,    2 c1 = G
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from finger3d._types import Float
from finger3d.fem.tensors import cofactor, determinant


class Derivatives(NamedTuple):
    """Derivatives (...,) MPa of an energy by two invariants, and the second one by the first; None: zero everywhere."""

    w1: Float
    w2: Float | None = None
    w11: Float | None = None


@dataclass(frozen=True)
class InvariantLaw(ABC):
    """Base class; a law gives the derivatives of its energy by the invariants.

    Attributes
    ----------
    shear : shear modulus at zero strain, MPa
    """

    shear: float

    def with_shear(self, shear: float) -> Self:
        """Return the law with another shear modulus."""
        return replace(self, shear=shear)

    @property
    @abstractmethod
    def is_stable(self) -> bool:
        """Whether the law is known to be stable at all strains."""

    @abstractmethod
    def derivatives(self, x1: Float, x2: Float) -> Derivatives:
        """Return the derivatives of the energy by the isochoric invariants (...,)."""

    def stress(self, f: Float) -> Float:
        """Return the first Piola-Kirchhoff stress (..., 3, 3)."""
        x1, x2 = _invariants(f)
        by = self.derivatives(x1, x2)
        inverse = _inverse_transpose(f)
        out = _wide(by.w1) * _gradient_1(f, inverse, x1)
        return out if by.w2 is None else out + _wide(by.w2) * _gradient_2(f, inverse, x2)

    def stress_and_tangent(self, f: Float) -> tuple[Float, Float]:
        """Return the stress and its derivative (..., 3, 3, 3, 3)."""
        x1, x2 = _invariants(f)
        by = self.derivatives(x1, x2)
        inverse = _inverse_transpose(f)
        g1 = _gradient_1(f, inverse, x1)
        stress, tangent = _wide(by.w1) * g1, _wide4(by.w1) * _hessian_1(f, inverse, x1)
        if by.w11 is not None:
            tangent += _wide4(by.w11) * _outer(g1, g1)
        if by.w2 is not None:
            g2 = _gradient_2(f, inverse, x2)
            stress, tangent = stress + _wide(by.w2) * g2, tangent + _wide4(by.w2) * _hessian_2(f, inverse, x2)
        return stress, tangent

    def kirchhoff(self, stretches: Float) -> Float:
        """Return principal Kirchhoff stresses."""
        by, g1, g2 = self._by_logs(stretches)
        stress = by.w1[..., None] * g1
        return stress if by.w2 is None else stress + by.w2[..., None] * g2

    def _by_logs(self, stretches: Float) -> tuple[Derivatives, Float, Float]:
        """Return the derivatives of the energy, and those of X1 and X2 (..., 3) by the logarithms of the stretches.

        X2 is the sum of 1/lambda^2 of isochoric stretches.
        """
        square = stretches**2
        inverse = 1.0 / square
        return self.derivatives(square.sum(axis=-1), inverse.sum(axis=-1)), 2.0 * square, -2.0 * inverse

    def principal_stress(self, stretches: Float) -> tuple[Float, Float]:
        """Return principal Kirchhoff stresses and their derivative."""
        by, g1, g2 = self._by_logs(stretches)
        stress, diagonal = by.w1[..., None] * g1, by.w1[..., None] * 2.0 * g1
        if by.w2 is not None:
            stress, diagonal = stress + by.w2[..., None] * g2, diagonal - by.w2[..., None] * 2.0 * g2
        out = diagonal[..., None] * np.eye(3)
        return stress, out if by.w11 is None else out + _wide(by.w11) * g1[..., :, None] * g1[..., None, :]


def _wide(scalar: Float) -> Float:
    return scalar[..., None, None]


def _wide4(scalar: Float) -> Float:
    return scalar[..., None, None, None, None]


def _outer(a: Float, b: Float) -> Float:
    return np.asarray(a[..., :, :, None, None] * b[..., None, None, :, :])


def _inverse_transpose(f: Float) -> Float:
    return np.asarray(cofactor(f) / _wide(determinant(f)))


def _right_cauchy_green(f: Float) -> Float:
    return np.asarray(np.swapaxes(f, -1, -2) @ f)


def _invariants(f: Float) -> tuple[Float, Float]:
    """Isochoric invariants (...,) of deformation gradients (..., 3, 3)."""
    scale = determinant(f) ** (-2.0 / 3.0)
    i1, i2 = (np.einsum("...ij,...ij->...", x, x) for x in (f, cofactor(f)))  # I2 = tr(cof C)
    return np.asarray(scale * i1), np.asarray(scale**2 * i2)


def _gradient_1(f: Float, inverse: Float, x1: Float) -> Float:
    """Return dX1/dF = 2 J^(-2/3) F - 2/3 X1 F^-T."""
    scale = determinant(f) ** (-2.0 / 3.0)
    return np.asarray(2.0 * _wide(scale) * f - 2.0 / 3.0 * _wide(x1) * inverse)


def _gradient_2(f: Float, inverse: Float, x2: Float) -> Float:
    """Return dX2/dF = 2 J^(-4/3) (I1 F - F C) - 4/3 X2 F^-T."""
    scale = determinant(f) ** (-4.0 / 3.0)
    return np.asarray(2.0 * _wide(scale) * _cofactor_rate(f) - 4.0 / 3.0 * _wide(x2) * inverse)


def _cofactor_rate(f: Float) -> Float:
    """Return I1 F - F C, half the derivative of I2."""
    c = _right_cauchy_green(f)
    return np.asarray(_wide(np.trace(c, axis1=-2, axis2=-1)) * f - f @ c)


def _scaled_hessian(power: float, x: Float, rate: Float, inverse: Float) -> Float:
    """Second derivative of J^-power I by F, less that of I itself times J^-power.

    `rate` (..., 3, 3) is J^-power dI/dF and x = J^-power I.
    """
    mixed = _outer(rate, inverse)
    both = _outer(inverse, inverse)
    out = -power * (mixed + np.moveaxis(mixed, (-4, -3, -2, -1), (-2, -1, -4, -3)))
    return np.asarray(out + power * _wide4(x) * (power * both + np.swapaxes(both, -1, -3)))


def _hessian_1(f: Float, inverse: Float, x1: Float) -> Float:
    scale = determinant(f) ** (-2.0 / 3.0)
    out = _scaled_hessian(2.0 / 3.0, x1, 2.0 * _wide(scale) * f, inverse)
    for i in range(3):
        for j in range(3):
            out[..., i, j, i, j] += 2.0 * scale
    return out


def _hessian_2(f: Float, inverse: Float, x2: Float) -> Float:
    scale = determinant(f) ** (-4.0 / 3.0)
    c = _right_cauchy_green(f)
    out = _scaled_hessian(4.0 / 3.0, x2, 2.0 * _wide(scale) * _cofactor_rate(f), inverse)
    # d(I1 F - F C)_iJ / dF_kL = 2 F_iJ F_kL + I1 d_ik d_JL - d_ik C_LJ - F_iL F_kJ - (F F^T)_ik d_JL
    pair = _outer(f, f)
    rate = 2.0 * pair - np.swapaxes(pair, -1, -3)
    left = f @ np.swapaxes(f, -1, -2)
    i1 = np.trace(c, axis1=-2, axis2=-1)
    for i in range(3):
        rate[..., i, :, i, :] -= c
        rate[..., :, i, :, i] -= left
        for j in range(3):
            rate[..., i, j, i, j] += i1
    return np.asarray(out + 2.0 * _wide4(scale) * rate)


@dataclass(frozen=True)
class NeoHooke(InvariantLaw):
    """Neo-Hookean law (Treloar 1943)."""

    @property
    def is_stable(self) -> bool:
        """True."""
        return True

    def derivatives(self, x1: Float, x2: Float) -> Derivatives:
        """Return the derivative G/2."""
        return Derivatives(np.asarray(0.5 * self.shear + np.zeros_like(x1)))


@dataclass(frozen=True)
class MooneyRivlin(InvariantLaw):
    """Mooney-Rivlin law (Mooney 1940).

    Attributes
    ----------
    c01_share : c01 over c10 + c01
    """

    c01_share: float

    @property
    def is_stable(self) -> bool:
        """Whether no constant is negative."""
        return 0.0 <= self.c01_share <= 1.0

    def derivatives(self, x1: Float, x2: Float) -> Derivatives:
        """Return c10 and c01."""
        half = 0.5 * self.shear + np.zeros_like(x1)
        return Derivatives(np.asarray(half * (1.0 - self.c01_share)), np.asarray(half * self.c01_share))


@dataclass(frozen=True)
class Yeoh(InvariantLaw):
    """Yeoh's law (Yeoh 1993).

    Attributes
    ----------
    c2_over_c1, c3_over_c1 : ratios of its constants
    """

    c2_over_c1: float
    c3_over_c1: float

    @property
    def is_stable(self) -> bool:
        """Whether no constant is negative."""
        return self.c2_over_c1 >= 0.0 and self.c3_over_c1 >= 0.0

    def derivatives(self, x1: Float, x2: Float) -> Derivatives:
        """Return the polynomial's derivatives."""
        e, c1 = x1 - 3.0, 0.5 * self.shear
        slope = c1 * (1.0 + e * (2.0 * self.c2_over_c1 + 3.0 * e * self.c3_over_c1))
        return Derivatives(np.asarray(slope), w11=np.asarray(c1 * (2.0 * self.c2_over_c1 + 6.0 * e * self.c3_over_c1)))
