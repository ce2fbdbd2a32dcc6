"""Curve of a reading against mu: interpolation, second-order fit, and errors of noise, curve and tolerances.

The interpolation is monotone and needs NumPy alone, since it runs on a robot without SciPy.

The readings are ``r = e(mu) + sum_t (s_t z_t + c_t z_t^2 / 2) + error``.  The sum is over the tolerances that all
readings share (depth, modulus, Poisson's ratio, tilt), with their deviations z_t in units of the standard deviation and
the first and second derivatives s_t, c_t of the readings.  The error has the diagonal covariance D of what every
reading has of its own: noise, interpolation, place of a gauge, mesh, and increments.  To second order the covariance of
the readings is ``C = D + sum_t (s_t s_t^T + c_t c_t^T / 2)``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float
from finger3d.errors import Finger3dError


@dataclass(frozen=True)
class MonotoneCubic:
    """Cubic Hermite interpolation that is monotone where the data are (PCHIP).

    The slopes are weighted harmonic means of those of the neighbouring intervals (Fritsch and Butland 1984), at the
    ends three-point formulas that keep the shape (Moler 2004, Sec. 3.4), as in `scipy.interpolate.PchipInterpolator`.

    Attributes
    ----------
    x, y, slope : (n,) arrays
        Ascending places, and values and slopes there; n of at least 2.
    """

    x: Float
    y: Float
    slope: Float

    @classmethod
    def of(cls, x: Float, y: Float) -> MonotoneCubic:
        """Return the interpolation of values (n,) at ascending places (n,)."""
        step = np.diff(x)
        secant = np.diff(y) / step
        if len(x) == 2:
            return cls(x, y, np.repeat(secant, 2))
        before, after = secant[:-1], secant[1:]
        w1, w2 = 2.0 * step[1:] + step[:-1], step[1:] + 2.0 * step[:-1]
        same = before * after > 0.0
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            mean = (w1 + w2) / (w1 / before + w2 / after)
        slope = np.zeros(len(x))
        slope[1:-1] = np.where(same, mean, 0.0)
        slope[0] = _end_slope(step[0], step[1], secant[0], secant[1])
        slope[-1] = _end_slope(step[-1], step[-2], secant[-1], secant[-2])
        return cls(x, y, slope)

    def __call__(self, x: ArrayLike, derivative: int = 0) -> Float:
        """Return values, or first derivatives, at places within the range; beyond it the end cubics continue."""
        x = np.asarray(x, dtype=float)
        k = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        step, rise = self.x[k + 1] - self.x[k], self.y[k + 1] - self.y[k]
        t, a, b = x - self.x[k], self.slope[k], self.slope[k + 1]
        second = (3.0 * rise / step - 2.0 * a - b) / step
        third = (a + b - 2.0 * rise / step) / step**2
        if derivative:
            return np.asarray(a + t * (2.0 * second + 3.0 * t * third))
        return np.asarray(self.y[k] + t * (a + t * (second + t * third)))


def _end_slope(near: float, far: float, secant: float, next_secant: float) -> float:
    """Return the slope at an end, with the lengths and secants of the two intervals beside it."""
    slope = ((2.0 * near + far) * secant - near * next_secant) / (near + far)
    if slope * secant <= 0.0:
        return 0.0
    if secant * next_secant <= 0.0 and abs(slope) > 3.0 * abs(secant):
        return 3.0 * secant
    return slope


Kind = Literal["gauge", "marker", "taxel"]

QUANTITIES: dict[Kind, tuple[str, str]] = {
    "gauge": ("strain", "1"),
    "marker": ("displacement", "mm"),
    "taxel": ("pressure", "MPa"),
}
"""What a reading of each kind is, and its unit."""

NOISE = 1.5e-4
"""Largest standard deviation of a strain in Maeno 2004, Sec. IV."""

MARKER_NOISE_MM, TAXEL_NOISE_MPA = 0.02, 1e-3
"""Assumed standard deviations: of the place of a dot that a camera tracks, and of a pressure cell."""

NOISES: dict[Kind, float] = {"gauge": NOISE, "marker": MARKER_NOISE_MM, "taxel": TAXEL_NOISE_MPA}

RESOLUTION = 0.1
"""The paper's error of mu, and the limit beyond which an estimate is called coarse here."""

LARGEST_STRAIN, LARGEST_SD = 1e3, 1e6
"""Largest magnitude of a reading (its standard deviation too), and of any other standard deviation."""

FEWEST = 4  # points: three make the second-order fit, one more its residual

_CUTS = 32  # grid points between two calibrated mu

_SHARPER = 4.0  # ratio of interpolation errors for half the spacing at second order, the order of PCHIP at extrema


@dataclass(frozen=True)
class Fit:
    """Second-order fit as in the paper's Fig. 14: strain = c0 + c1 mu + c2 mu^2, and its residual (strain)."""

    coefficients: tuple[float, float, float]
    rms: float
    largest: float

    def at(self, mu: ArrayLike) -> Float:
        """Return the strain at mu."""
        c0, c1, c2 = self.coefficients
        return np.asarray(c0 + c1 * np.asarray(mu) + c2 * np.asarray(mu) ** 2)


@dataclass(frozen=True)
class Tolerance:
    """Quantity with a tolerance: its standard deviation and its effect on a reading.

    Attributes
    ----------
    sd : in `unit`
    slope, curvature : (n,) first and second derivative of the reading at the calibration's mu, per unit and unit^2
    """

    name: str
    unit: str
    sd: float
    slope: Float
    curvature: Float

    @property
    def spread(self) -> Float:
        """Standard deviation (n,) of the reading, to second order in the quantity."""
        return np.asarray(np.hypot(self.slope * self.sd, self.curvature * self.sd**2 / math.sqrt(2.0)))


@dataclass(frozen=True)
class ReadingCurve:
    """Reading (n,) of a gauge, marker or taxel at ascending mu (n,).

    Attributes
    ----------
    name : of the gauge or taxel, or as ``m1.x`` of a marker
    noise : standard deviation of a reading
    tolerances : of this reading
    """

    name: str
    mu: Float
    reading: Float
    noise: float
    tolerances: tuple[Tolerance, ...] = ()
    kind: Kind = "gauge"

    @cached_property
    def fit(self) -> Fit:
        """Least squares of second order."""
        c2, c1, c0 = np.polyfit(self.mu, self.reading, 2)
        left = self.reading - np.polyval([c2, c1, c0], self.mu)
        return Fit((float(c0), float(c1), float(c2)), float(np.sqrt(np.mean(left**2))), float(np.abs(left).max()))

    @cached_property
    def _pchip(self) -> MonotoneCubic:
        return MonotoneCubic.of(self.mu, self.reading)

    def at(self, mu: ArrayLike) -> Float:
        """Return the reading at mu in the calibrated range, by monotone cubic interpolation (PCHIP)."""
        return np.asarray(self._pchip(mu))

    def slope(self, mu: ArrayLike) -> Float:
        """Return d reading / d mu."""
        return np.asarray(self._pchip(mu, 1))

    def resolution(self, mu: ArrayLike) -> Float:
        """Return the standard deviation of mu due to the noise alone, noise / |d reading / d mu|."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.noise / np.abs(self.slope(mu)))

    @cached_property
    def _missed(self) -> Float:
        """Error (n,) of the interpolation near every mu."""
        errors = np.zeros(len(self.mu))
        every = np.arange(len(self.mu))
        for first in (1, 2):
            out = every[first:-1:2]
            kept = np.setdiff1d(every, out)
            left = self.reading[out] - MonotoneCubic.of(self.mu[kept], self.reading[kept])(self.mu[out])
            errors[out] = np.abs(left) / _SHARPER
        errors[[0, -1]] = errors[[1, -2]]
        # a kink between two of the points is seen from either of them, or from the next
        return np.asarray(np.max([errors, np.append(errors[1:], 0.0), np.append(0.0, errors[:-1])], axis=0))

    def curve_error(self, mu: ArrayLike) -> Float:
        """Return the error (m,) of the curve at mu (m,), a quarter of the change at every second point if left out."""
        return np.asarray(np.interp(np.asarray(mu, dtype=float), self.mu, self._missed))

    @cached_property
    def grid(self) -> Float:
        """Mu (m,) on which the likelihood is evaluated: the calibrated ones and 31 between any two."""
        fractions = np.arange(_CUTS) / _CUTS
        inner = self.mu[:-1, None] + np.diff(self.mu)[:, None] * fractions
        return np.append(inner.ravel(), self.mu[-1])

    def tolerance_sd(self, mu: ArrayLike) -> Float:
        """Return the error (k, m) of the reading due to every tolerance at mu (m,)."""
        mus = np.atleast_1d(np.asarray(mu, dtype=float))
        rows = [np.interp(mus, self.mu, t.spread) for t in self.tolerances]
        return np.array(rows).reshape(len(rows), len(mus))

    def reading_sd(self, mu: ArrayLike) -> Float:
        """Return the standard deviation of a reading: noise, error of the interpolation, and tolerances."""
        squares = self.noise**2 + self.curve_error(mu) ** 2 + np.sum(self.tolerance_sd(mu) ** 2, axis=0)
        return np.asarray(np.sqrt(squares))


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
        whole, names = self.mu_sd(mu) ** 2, ("noise", *self.tolerance_names)
        with np.errstate(invalid="ignore"):
            return {name: np.nan_to_num(1.0 - self.mu_sd(mu, without=name) ** 2 / whole) for name in names}


def _squares(effects: Float) -> Float:
    """Return the sum (m, k, k) of the squares of effects (m, k, q) over the tolerances."""
    return effects @ effects.transpose(0, 2, 1)
