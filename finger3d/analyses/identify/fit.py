"""Weighted least squares.

Values are fitted as shares of their range, on a logarithmic scale where the bounds differ by more than a decade.

Each step solves the linear least-squares problem within the bounds and a box around the values.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from finger3d._types import Float
from finger3d.analyses.free_keys import FIRST_BOX, LEAST_GAIN, FreeKey, next_box
from finger3d.errors import Finger3dError

_STEP = 0.01
"""Step of shares for the Jacobian; contact changes point by point, so that smaller steps would resolve the mesh."""

_SHARE_CHANGE, _COST_CHANGE, _MOST = 1e-4, 1e-4, 40
"""Largest step, and foretold fall of the sum of squares over one plus it, at which the fit ends, and its most steps."""

_INSIDE = 1e-9
"""Margin of the bounds of a step, which must not coincide."""

_MISFIT = 2.0  # residuals over their stated standard deviation beyond which the scene does not explain the data
_DECADE = 10.0


@dataclass(frozen=True)
class Scale:
    """Values of a free key as shares of its range, from 0 to 1."""

    key: str
    low: float
    high: float

    @classmethod
    def of(cls, free: FreeKey) -> Scale:
        """Return the scale of a free key."""
        return cls(free.key, free.low, free.high)

    @property
    def is_logarithmic(self) -> bool:
        """Whether the bounds are positive and differ by more than a decade."""
        return self.low > 0.0 and self.high / self.low > _DECADE

    def value(self, share: float) -> float:
        """Return the value at a share."""
        if self.is_logarithmic:
            return self.low * math.pow(self.high / self.low, share)
        return self.low + (self.high - self.low) * share

    def share(self, value: float) -> float:
        """Return the share of a value."""
        if self.is_logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def slope(self, share: float) -> float:
        """Return d value / d share."""
        return self.value(share) * math.log(self.high / self.low) if self.is_logarithmic else self.high - self.low


Residuals = Callable[[Float], Float]
"""Residuals (n,) over their standard deviations for values (k,); raises Finger3dError if a press fails."""


def fit(
    scales: Sequence[Scale],
    start: Float,
    residuals: Residuals,
    announce: Callable[[Float], None],
    free: Sequence[int] = (),
) -> Float:
    """Return the shares (k,) with the least sum of squared residuals, from those of `start`.

    Each step is the solution of the linear problem within the bounds and within a box, which shrinks where the sum of
    squares falls less than foretold: where all of the contact sticks nothing tells friction, so that a fit does not
    return from there.  The derivatives follow the steps by Broyden's update, and are taken anew where a step gains less
    than foretold.  `announce` is called with the values of each iteration.

    Parameters
    ----------
    free : numbers of the shares whose derivatives need no press, and are taken anew in every step
    """
    shares, box, is_new = np.clip(start, 0.0, 1.0), FIRST_BOX, True
    now, derivative = residuals(values_at(scales, shares)), jacobian(scales, shares, residuals)
    for _ in range(_MOST):
        announce(values_at(scales, shares))
        cost, gain = float(now @ now), -1.0
        step, left = _step(derivative, now, shares, box)
        if box < _SHARE_CHANGE or cost - left <= _COST_CHANGE * (1.0 + left):
            if is_new:
                return shares
            derivative, is_new = jacobian(scales, shares, residuals), True
            continue
        try:
            after = residuals(values_at(scales, shares + step))
        except Finger3dError:
            after = np.full(len(now), np.inf)
        gain = (cost - float(after @ after)) / (cost - left)
        if gain < LEAST_GAIN:
            box = next_box(box, float(np.abs(step).max()), gain) if is_new else box
            derivative, is_new = (derivative if is_new else jacobian(scales, shares, residuals)), True
            continue
        box = next_box(box, float(np.abs(step).max()), gain)
        derivative = derivative + np.outer(after - now - derivative @ step, step) / float(step @ step)
        shares, now, is_new = shares + step, after, False
        if free:
            derivative[:, free] = jacobian(scales, shares, residuals, free)
    return shares


def _step(derivative: Float, now: Float, shares: Float, box: float = 1.0) -> tuple[Float, float]:
    """Return the step (k,) to the least sum of squares by the derivatives (n, k), and that sum.

    A step over the whole range of a share counts as one standard deviation, so that values stay where the data do not
    determine them.
    """
    low, high = np.maximum(-shares, -box), np.minimum(1.0 - shares, box)
    damped = np.vstack([derivative, np.eye(len(shares))]), np.concatenate([-now, np.zeros(len(shares))])
    step = np.asarray(optimize.lsq_linear(*damped, (low - _INSIDE, high + _INSIDE)).x).clip(low, high)
    return step, float(np.sum((now + derivative @ step) ** 2))


def values_at(scales: Sequence[Scale], shares: Float) -> Float:
    """Return values (k,) at shares (k,)."""
    return np.array([scale.value(float(share)) for scale, share in zip(scales, shares, strict=True)])


def jacobian(
    scales: Sequence[Scale], shares: Float, residuals: Residuals, wanted: Sequence[int] | None = None
) -> Float:
    """Return the derivatives (n, k) of residuals by shares, as differences to the side with more room.

    Parameters
    ----------
    wanted : numbers of the shares; all unless given
    """
    now, columns = residuals(values_at(scales, shares)), []
    for i in range(len(scales)) if wanted is None else wanted:
        step = _STEP if shares[i] <= 0.5 else -_STEP
        other = residuals(values_at(scales, shares + step * (np.arange(len(scales)) == i)))
        columns.append((other - now) / step)
    return np.array(columns).reshape(-1, len(now)).T


def misfit_text(reduced: float) -> str:
    """Say whether residuals are larger than their standard deviations, from the reduced chi-square."""
    ratio = math.sqrt(reduced)
    if ratio <= _MISFIT:
        return ""
    return f"the residuals are {ratio:.2g} times their standard deviations: the scene does not explain the data"
