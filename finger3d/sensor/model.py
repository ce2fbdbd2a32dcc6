"""Forward model of a sensor: its readings as functions of mu, and the covariance of their errors.

The readings are ``r = e(mu) + sum_t (s_t z_t + c_t z_t^2 / 2) + error``.  The sum is over the tolerances that all
readings share (depth, modulus, Poisson's ratio, tilt), with their deviations z_t in units of the standard deviation and
the first and second derivatives s_t, c_t of the readings.  The error has the diagonal covariance D of what every
reading has of its own: noise, interpolation, place of a gauge, mesh, and increments.  To second order the covariance of
the readings is ``C = D + sum_t (s_t s_t^T + c_t c_t^T / 2)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.sensor.curve import ReadingCurve

SHARED = ("depth_mm", "E_percent", "nu", "tilt_deg")
"""Tolerances that change all readings together."""

_LEAST_NOISE = 1e-3  # relative to the noise of a calibration: an exact reading leaves the covariance regular


@dataclass(frozen=True)
class Errors:
    """What changes readings (k) at mu (m,) besides friction.

    Attributes
    ----------
    variance : (m, k) of what every reading has of its own
    slope, curvature : (m, k, q) first and second derivative by the shared tolerances, in units of their deviations
    """

    variance: Float
    slope: Float
    curvature: Float


@dataclass(frozen=True, repr=False, eq=False)
class SensorModel:
    """Curves of one or more readings (k) of the same presses, all at the same mu."""

    readings: tuple[ReadingCurve, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the readings."""
        return tuple(c.name for c in self.readings)

    @property
    def mu(self) -> Float:
        """Calibrated coefficients of friction (n,), ascending."""
        return self.readings[0].mu

    @property
    def grid(self) -> Float:
        """Mu (m,) on which the likelihood is evaluated."""
        return self.readings[0].grid

    @property
    def noise(self) -> Float:
        """Standard deviation (k,) of the noise of every reading, in its unit."""
        return np.array([c.noise for c in self.readings])

    @property
    def tolerance_names(self) -> tuple[str, ...]:
        """Names of the tolerances of any reading."""
        return tuple(dict.fromkeys(t.name for c in self.readings for t in c.tolerances))

    def __getitem__(self, name: str) -> ReadingCurve:
        """Return the curve of a reading."""
        for curve in self.readings:
            if curve.name == name:
                return curve
        raise Finger3dError(f"{name}: not calibrated; calibrated: {', '.join(self.names)}")

    def of(self, names: Sequence[str]) -> Self:
        """Return the same with some of the readings, in this order."""
        return replace(self, readings=tuple(self[name] for name in names))

    def at(self, mu: ArrayLike) -> Float:
        """Return the readings (m, k) at mu (m,)."""
        return np.stack([c.at(mu) for c in self.readings], axis=-1)

    def slope(self, mu: ArrayLike) -> Float:
        """Return d reading / d mu (m, k) at mu (m,)."""
        return np.stack([c.slope(mu) for c in self.readings], axis=-1)

    def errors(self, mu: ArrayLike, noise: Float | None = None, without: str = "") -> Errors:
        """Return what changes the readings at mu (m,) besides friction.

        Parameters
        ----------
        noise : (k,) standard deviations in place of those of the calibration
        without : name of a tolerance that is known exactly, or ``"noise"``
        """
        mus = np.atleast_1d(np.asarray(mu, dtype=float))
        scale = self.noise
        variance = np.array([c.curve_error(mus) ** 2 for c in self.readings]).T
        if without != "noise":
            variance = variance + np.maximum(scale if noise is None else noise, _LEAST_NOISE * scale) ** 2
        shared = [name for name in SHARED if name in self.tolerance_names and name != without]
        slope, curvature = np.zeros((2, len(mus), len(self.readings), len(shared)))
        for i, c in enumerate(self.readings):
            for t in (t for t in c.tolerances if t.name != without):
                if t.name in shared:
                    slope[:, i, shared.index(t.name)] = t.sd * np.interp(mus, c.mu, t.slope)
                    curvature[:, i, shared.index(t.name)] = t.sd**2 * np.interp(mus, c.mu, t.curvature)
                else:
                    variance[:, i] += np.interp(mus, c.mu, t.spread) ** 2
        return Errors(np.maximum(variance, (_LEAST_NOISE * scale) ** 2), slope, curvature)

    def covariance(self, mu: ArrayLike, without: str = "") -> Float:
        """Return the covariance (m, k, k) of the readings at mu (m,), without a tolerance or the ``"noise"``."""
        errors = self.errors(mu, without=without)
        total = errors.variance[:, :, None] * np.eye(len(self.readings))
        return np.asarray(total + _squares(errors.slope) + 0.5 * _squares(errors.curvature))

    def mu_sd(self, mu: ArrayLike, without: str = "") -> Float:
        """Return the standard deviation (m,) of mu of a linear model, ``1 / sqrt(s^T C^-1 s)`` with the slopes s.

        It holds where the curves are straight over several of these deviations; that of an estimate holds on any curve.
        """
        slope = np.atleast_2d(self.slope(np.atleast_1d(mu)))
        slope = slope / self.noise
        covariance = self.covariance(mu, without=without) / np.outer(self.noise, self.noise)
        information = np.einsum("mi,mi->m", slope, np.linalg.solve(covariance, slope[:, :, None])[:, :, 0])
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / np.sqrt(np.maximum(information, 0.0)))

    def reductions(self, mu: ArrayLike) -> dict[str, Float]:
        """Return, for the noise and each tolerance, the share (m,) of the variance of mu that it alone adds.

        It is the reduction of the variance of the linear model if that quantity were known exactly.  Shares of several
        readings need not sum to 1.
        """
        whole = self.mu_sd(mu) ** 2
        with np.errstate(invalid="ignore"):
            return {
                name: np.nan_to_num(1.0 - self.mu_sd(mu, without=name) ** 2 / whole)
                for name in ("noise", *self.tolerance_names)
            }


def _squares(effects: Float) -> Float:
    """Return the sum (m, k, k) of the squares of effects (m, k, q) over the tolerances."""
    return effects @ effects.transpose(0, 2, 1)
