"""Ogden's law, W = sum of mu_p / alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3) with 2 G = sum of mu_p alpha_p.

Stress and tangent are evaluated in the principal directions of C = F^T F (Bonet and Wood 2008, sec. 6.6; Holzapfel
2000, sec. 6.6).  Where stretches coincide the shear moduli in these directions are derivatives, elsewhere quotients of
differences; one formula that loses no digits gives both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.tensors import InvertedError, determinant


@dataclass(frozen=True)
class Ogden:
    """Ogden's law (Ogden 1972).

    Attributes
    ----------
    shear : shear modulus at zero strain, MPa
    terms : (share of the shear modulus, alpha) of each term: mu = 2 share G / alpha
    """

    shear: float
    terms: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        """Raise an error if the shares do not sum to 1 or an exponent is 0."""
        total = sum(share for share, _ in self.terms)
        if np.any(abs(total - 1.0) > 1e-9):
            raise Finger3dError(
                f"effects.large_deformation.terms: the shares of the shear modulus sum to {total:.6g}; must be 1"
            )
        if any(np.any(alpha == 0.0) for _, alpha in self.terms):
            raise Finger3dError("effects.large_deformation.terms: an exponent alpha is 0; must not be")

    @property
    def is_stable(self) -> bool:
        """Whether no share is negative."""
        return all(share >= 0.0 for share, _ in self.terms)

    def with_shear(self, shear: float) -> Self:
        """Return the law with another shear modulus."""
        return replace(self, shear=shear)

    def _constants(self) -> list[tuple[float, float]]:
        """Pairs (mu, alpha)."""
        return [(2.0 * share * self.shear / alpha, alpha) for share, alpha in self.terms]

    def kirchhoff(self, stretches: Float) -> Float:
        """Return the sum of mu (l^alpha - 1).

        The power less 1 is a pressure that keeps the digits which a large mu = 2 share G / alpha would lose.
        """
        logs = np.log(stretches)
        constants = [(np.asarray(mu)[..., None], np.asarray(a)[..., None]) for mu, a in self._constants()]
        return np.asarray(sum(mu * np.expm1(a * logs) for mu, a in constants))

    def principal_stress(self, stretches: Float) -> tuple[Float, Float]:
        """Return the principal Kirchhoff stresses, and the sum of mu alpha l^alpha on the diagonal."""
        logs, stress = np.log(stretches), self.kirchhoff(stretches)
        slope = np.asarray(sum(mu * a * np.exp(a * logs) for mu, a in self._constants()))
        return stress, slope[..., None] * np.eye(3)

    def stress(self, f: Float) -> Float:
        """Return the first Piola-Kirchhoff stress (..., 3, 3); raises InvertedError."""
        square, vectors = _principal(f)
        second = self._second(square, determinant(f))
        return np.asarray((f @ vectors) * second[..., None, :] @ np.swapaxes(vectors, -1, -2))

    def _second(self, square: Float, j: Float) -> Float:
        """Principal second Piola-Kirchhoff stresses (..., 3): the deviator of the sum of mu l^alpha, over l^2."""
        kirchhoff = self.principal_stress(np.sqrt(square) * j[..., None] ** (-1.0 / 3.0))[0]
        return np.asarray((kirchhoff - kirchhoff.mean(axis=-1, keepdims=True)) / square)

    def stress_and_tangent(self, f: Float) -> tuple[Float, Float]:
        """Return the stress and its derivative (..., 3, 3, 3, 3); raises InvertedError."""
        square, vectors = _principal(f)
        j = determinant(f)
        second = self._second(square, j)
        axes, turned = np.swapaxes(vectors, -1, -2), np.swapaxes(f @ vectors, -1, -2)  # rows N_a and F N_a
        stress = np.einsum("...a,...ai,...aJ->...iJ", second, turned, axes, optimize=True)
        # with E_ab = F N_a (x) N_b: d(S) = sum of c_ab sym parts, P = F S
        normal = self._normal_moduli(square, j, second)
        shear = self._shear_moduli(square, j, second)
        pairs = turned[..., :, None, :, None] * axes[..., None, :, None, :]  # (a, b, i, J)
        tangent = np.einsum("...ab,...aaiJ,...bbkL->...iJkL", normal, pairs, pairs, optimize=True)
        tangent += np.einsum("...ab,...abiJ,...abkL->...iJkL", shear, pairs, pairs, optimize=True)
        tangent += np.einsum("...ab,...abiJ,...bakL->...iJkL", shear, pairs, pairs, optimize=True)
        whole = np.einsum("...a,...aJ,...aL->...JL", second, axes, axes, optimize=True)
        for i in range(3):
            tangent[..., i, :, i, :] += whole
        return stress, tangent

    def _normal_moduli(self, square: Float, j: Float, second: Float) -> Float:
        """2 dS_a / d(l_b^2) (..., 3, 3) at fixed principal directions."""
        slope = np.diagonal(
            self.principal_stress(np.sqrt(square) * j[..., None] ** (-1.0 / 3.0))[1], axis1=-2, axis2=-1
        )
        # d(tau_a) / d(ln l_b) with l_b J^(-1/3): slope_a (d_ab - 1/3), then the deviator
        rate = slope[..., :, None] * (np.eye(3) - 1.0 / 3.0)
        rate = rate - rate.mean(axis=-2, keepdims=True)
        inverse = 1.0 / square
        out = rate * inverse[..., :, None] * inverse[..., None, :]
        return np.asarray(out - 2.0 * (second * inverse)[..., None] * np.eye(3))

    def _shear_moduli(self, square: Float, j: Float, second: Float) -> Float:
        """(S_a - S_b) / (l_a^2 - l_b^2) (..., 3, 3), zero on the diagonal.

        With x = l^2 and the Kirchhoff stress tau = S x it is ((tau_a - tau_b) / (x_a - x_b) - S_b) / x_a, and of the
        terms mu x^q of tau the quotient is mu x_b^(q-1) expm1(q t) / expm1(t) with t = ln(x_a / x_b).
        """
        x, y = square[..., :, None], square[..., None, :]
        apart = (x - y) / y
        t = np.where(np.abs(apart) < 0.5, np.log1p(np.maximum(apart, -0.5)), np.log(x / y))
        scale = j ** (-1.0 / 3.0)
        out = np.zeros((*square.shape, 3))
        for mu, a in self._constants():
            out += (mu * scale**a)[..., None, None] * y ** (0.5 * a - 1.0) * _ratio(0.5 * a, t)
        out = (out - second[..., None, :]) / x
        out[..., np.arange(3), np.arange(3)] = 0.0
        return out


def _principal(f: Float) -> tuple[Float, Float]:
    """Return the squares of the principal stretches (..., 3), and their directions at rest as columns (..., 3, 3).

    Raises
    ------
    InvertedError
        If the smallest stretch of a tensor is lost in the round-off of the largest.
    """
    right = np.swapaxes(f, -1, -2) @ f
    if np.isfinite(right).all():
        square, vectors = np.linalg.eigh(right)
        if (square > 0.0).all():
            return square, vectors
    raise InvertedError


def _ratio(q: float, t: Float) -> Float:
    """expm1(q t) / expm1(t), q at t = 0."""
    safe = np.where(t == 0.0, 1.0, t)
    return np.where(t == 0.0, q, np.expm1(q * safe) / np.expm1(safe))
