"""Monotone cubic interpolation with NumPy alone, for code that runs on a robot without SciPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float


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
