"""Weighted least squares, and the uncertainty of the fitted values.

Values are fitted as shares of their range, on a logarithmic scale where the bounds differ by more than a decade.  With
the Jacobian J of the residuals over their standard deviations, ``J^T J`` is the Fisher matrix and its inverse the
covariance of the values (Bard 1974, Ch. 7).  An eigenvector of the Fisher matrix along which the standard deviation is
a quarter of the range or more is a combination of values that the data do not determine.

Each step solves the linear least-squares problem within the bounds and a box around the values.  Of several first
values the fit takes those from which such a step would leave the least sum of squares.

Errors b of the simulation shift the values by ``(J^T J)^-1 J^T b``.
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

_SHARE_CHANGE, _COST_CHANGE, _MOST = 1e-4, 1e-3, 40
"""Largest step, and foretold fall of the sum of squares over one plus it, at which the fit ends, and its most steps."""

_INSIDE = 1e-9
"""Margin of the bounds of a step, which must not coincide."""

_UNTOLD = 0.25
"""Standard deviation of a combination, relative to the range, at which the data do not determine it."""

_STRONG = 0.95  # correlation that is named
_AT_BOUND = 1e-3  # distance of a share from 0 or 1
_PART = 0.3  # component of an eigenvector that is named
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


@dataclass(frozen=True)
class FittedValues:
    """Values of k free keys.

    Attributes
    ----------
    values, stds : (k,) arrays
    low, high : (k,) ends of the 68 % intervals, within the bounds
    correlation : (k, k)
    shares : (k,) of the ranges
    untold : remarks on values that the data do not determine, that are strongly correlated, or that are at a bound
    numerical : (k,) standard deviations that errors of mesh and increments leave, a part of `stds`
    """

    values: Float
    stds: Float
    low: Float
    high: Float
    correlation: Float
    shares: Float
    untold: tuple[str, ...]
    numerical: Float


Residuals = Callable[[Float], Float]
"""Residuals (n,) over their standard deviations for values (k,); raises Finger3dError if a press fails."""

Slopes = Callable[[Float], "Float | None"]
"""Derivatives (n, k) of the residuals by the values; None where they are not known."""


def fit(
    scales: Sequence[Scale],
    start: Float,
    residuals: Residuals,
    slopes: Slopes,
    announce: Callable[[Float], None],
) -> Float:
    """Return the shares (k,) with the least sum of squared residuals, from those of `start`.

    Each step is the solution of the linear problem within the bounds and within a box, which shrinks where the sum of
    squares falls less than foretold: where all of the contact sticks nothing tells friction, so that a fit does not
    return from there.  `announce` is called with the values of each iteration.
    """
    shares, box = np.clip(start, 0.0, 1.0), FIRST_BOX
    now = residuals(values_at(scales, shares))
    for _ in range(_MOST):
        announce(values_at(scales, shares))
        derivative, cost, gain = jacobian(scales, shares, residuals, slopes), float(now @ now), -1.0
        while gain < LEAST_GAIN:
            step, left = _step(derivative, now, shares, box)
            if box < _SHARE_CHANGE or cost - left <= _COST_CHANGE * (1.0 + left):
                return shares
            try:
                after = residuals(values_at(scales, shares + step))
            except Finger3dError:
                after = np.full(len(now), np.inf)
            gain = (cost - float(after @ after)) / (cost - left)
            box = next_box(box, float(np.abs(step).max()), gain)
        shares, now = shares + step, after
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


def _slopes(scales: Sequence[Scale], shares: Float) -> Float:
    """Return the derivatives (k,) of values by shares."""
    return np.array([scale.slope(float(share)) for scale, share in zip(scales, shares, strict=True)])


def foretold(scales: Sequence[Scale], shares: Float, residuals: Residuals, slopes: Slopes) -> float:
    """Return the sum of squares after a step from `shares`, by the derivatives there; that before where not known."""
    values = values_at(scales, shares)
    now, known = residuals(values), slopes(values)
    if known is None:
        return float(now @ now)
    return _step(known * _slopes(scales, shares), now, shares)[1]


def jacobian(scales: Sequence[Scale], shares: Float, residuals: Residuals, slopes: Slopes) -> Float:
    """Return the derivatives (n, k) of residuals by shares; central differences where those by values are not known."""
    known = slopes(values_at(scales, shares))
    if known is not None:
        return known * _slopes(scales, shares)
    columns = []
    for i in range(len(scales)):
        ends = [float(np.clip(shares[i] + step, 0.0, 1.0)) for step in (-_STEP, _STEP)]
        low, high = (residuals(values_at(scales, np.where(np.arange(len(scales)) == i, end, shares))) for end in ends)
        columns.append((high - low) / (ends[1] - ends[0]))
    return np.array(columns).T


def uncertainty(scales: Sequence[Scale], shares: Float, derivative: Float, errors: Float) -> FittedValues:
    """Return the values with their uncertainty.

    The 68 % interval of a value reaches one standard deviation of its share to both sides, within the bounds, and the
    root mean square of the distances of its ends is the standard deviation of the value.

    Parameters
    ----------
    derivative : (n, k) of the residuals by shares
    errors : (m, n) standard deviations of m independent errors of the simulation, each of which shifts all residuals
    """
    fisher = derivative.T @ derivative
    eigenvalues, vectors = np.linalg.eigh(fisher)
    # prior knowledge: a uniform distribution over the range, whose variance is 1/12
    of_noise = (vectors / (np.maximum(eigenvalues, 0.0) + 12.0)) @ vectors.T
    shifts = errors @ derivative @ of_noise
    covariance = of_noise + shifts.T @ shifts
    sd = np.sqrt(np.diag(covariance))
    values = values_at(scales, shares)
    low, high = (values_at(scales, np.clip(shares + sign * sd, 0.0, 1.0)) for sign in (-1.0, 1.0))
    stds = np.sqrt(0.5 * ((values - low) ** 2 + (high - values) ** 2))
    told = [
        *_untold(scales, eigenvalues, vectors),
        *_correlated(scales, _correlation(of_noise), eigenvalues),
        *_bound(scales, shares),
    ]
    numerical = stds * np.linalg.norm(shifts, axis=0) / sd
    return FittedValues(values, stds, low, high, _correlation(covariance), shares, tuple(told), numerical)


def _correlation(covariance: Float) -> Float:
    sd = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(sd, sd))


def _untold(scales: Sequence[Scale], eigenvalues: Float, vectors: Float) -> list[str]:
    """Name the values, or combinations of them, that the data do not determine."""
    found = []
    for value, vector in zip(eigenvalues, vectors.T, strict=True):
        if value * _UNTOLD**2 < 1.0:
            parts = [i for i in np.argsort(-np.abs(vector)) if abs(vector[i]) >= _PART]
            names = [scales[i].key for i in parts]
            if len(names) == 1:
                found.append(f"the data cannot tell {names[0]} within its bounds")
            else:
                same = np.sign(vector[parts]) == np.sign(vector[parts[0]])
                how = "rise together" if same.all() else "change against each other"
                found.append(f"the data cannot tell {' and '.join(names)} apart: they may {how} and fit as well")
    return found


def _correlated(scales: Sequence[Scale], correlation: Float, eigenvalues: Float) -> list[str]:
    """Name pairs of values that are known much better together than each alone."""
    if eigenvalues.min() * _UNTOLD**2 < 1.0:
        return []
    pairs = [(i, j) for i in range(len(scales)) for j in range(i) if abs(correlation[i, j]) > _STRONG]
    return [
        f"{scales[j].key} and {scales[i].key} are correlated by {correlation[i, j]:.3f}: fix one, and the other is "
        "known better"
        for i, j in pairs
    ]


def _bound(scales: Sequence[Scale], shares: Float) -> list[str]:
    ends = [(scale, share) for scale, share in zip(scales, shares, strict=True) if min(share, 1.0 - share) < _AT_BOUND]
    return [f"{scale.key} is at its {'lower' if share < 0.5 else 'upper'} bound: widen it" for scale, share in ends]


def misfit_text(reduced: float) -> str:
    """Say whether residuals are larger than their standard deviations, from the reduced chi-square."""
    ratio = math.sqrt(reduced)
    if ratio <= _MISFIT:
        return ""
    return f"the residuals are {ratio:.2g} times their standard deviations: the scene does not explain the data"
