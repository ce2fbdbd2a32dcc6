"""Weighted least squares, and the uncertainty of the fitted values.

Values are fitted as shares of their range, on a logarithmic scale where the bounds differ by more than a decade.  With
the Jacobian J of the residuals over their standard deviations, ``J^T J`` is the Fisher matrix and its inverse the
covariance of the values (Bard 1974, Ch. 7).  An eigenvector of the Fisher matrix along which the standard deviation is
a quarter of the range or more is a combination of values that the data do not determine.

The response to friction saturates, so that the curvature at the solution may not hold one standard deviation away.
Each value is therefore varied, and the others with it according to their covariance, until the sum of squares has
increased by one: these are the ends of its 68 % interval, and the root mean square of their distances from the value
is the standard deviation that the noise leaves.

Errors b of the simulation shift the values by ``(J^T J)^-1 J^T b``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from finger3d._types import Float
from finger3d.analyses.free_keys import FreeKey
from finger3d.errors import Finger3dError

_STEP = 0.01
"""Step of shares for the Jacobian; contact changes point by point, so that smaller steps would resolve the mesh."""

_SHARE_CHANGE, _COST_CHANGE, _MOST = 1e-4, 1e-5, 40
"""Relative changes of the shares and of the sum of squares at which the fit ends, and its largest number of trials."""

_INSIDE = 1e-6
"""Distance of the first shares from their bounds, which the trust region method asks for."""

_UNTOLD = 0.25
"""Standard deviation of a combination, relative to the range, at which the data do not determine it."""

_TRIALS, _RISE_TOLERANCE, _LARGEST_STEP = 6, 0.1, 3.0
"""Trials for an end of an interval, tolerance of the rise of the sum of squares, and largest change of a step."""

_STRONG = 0.95  # correlation that is named
_AT_BOUND = 1e-3  # distance of a share from 0 or 1
_PART = 0.3  # component of an eigenvector that is named
_FAILED = 1e3  # residuals of a failed press, in standard deviations
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

    def with_errors(self, scales: Sequence[Scale], derivative: Float, errors: Float) -> FittedValues:
        """Return the values with standard deviations to which errors of the simulation are added.

        Parameters
        ----------
        derivative : (n, k) of the residuals by shares
        errors : (m, n) standard deviations of m independent errors, each of which shifts all residuals at once
        """
        fisher = derivative.T @ derivative + 12.0 * np.eye(len(self.values))  # see `uncertainty`
        slopes = np.array([scale.slope(float(share)) for scale, share in zip(scales, self.shares, strict=True)])
        shifts = np.linalg.solve(fisher, derivative.T @ errors.T).T * slopes
        numerical = np.linalg.norm(shifts, axis=0)
        covariance = self.correlation * np.outer(self.stds, self.stds) + shifts.T @ shifts
        stds = np.sqrt(np.diag(covariance))
        ends = [
            np.hypot(side, numerical) * sign + self.values
            for side, sign in ((self.values - self.low, -1.0), (self.high - self.values, 1.0))
        ]
        bounds = np.array([[scale.low, scale.high] for scale in scales]).T
        low, high = (np.clip(end, *bounds) for end in ends)
        correlation = covariance / np.outer(stds, stds)
        return replace(self, stds=stds, low=low, high=high, correlation=correlation, numerical=numerical)


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

    `announce` is called with the values of each iteration.
    """
    count = len(residuals(values_at(scales, start)))

    def cost(shares: Float) -> Float:
        try:
            return residuals(values_at(scales, shares))
        except Finger3dError:
            return np.full(count, _FAILED)

    def slope(shares: Float) -> Float:
        announce(values_at(scales, shares))
        return jacobian(scales, shares, residuals, slopes)

    inside = np.clip(start, _INSIDE, 1.0 - _INSIDE)
    found = optimize.least_squares(
        cost, inside, slope, bounds=(0.0, 1.0), xtol=_SHARE_CHANGE, ftol=_COST_CHANGE, gtol=None, max_nfev=_MOST
    )
    return np.asarray(found.x)


def values_at(scales: Sequence[Scale], shares: Float) -> Float:
    """Return values (k,) at shares (k,)."""
    return np.array([scale.value(float(share)) for scale, share in zip(scales, shares, strict=True)])


def jacobian(scales: Sequence[Scale], shares: Float, residuals: Residuals, slopes: Slopes) -> Float:
    """Return the derivatives (n, k) of residuals by shares; central differences where those by values are not known."""
    known = slopes(values_at(scales, shares))
    if known is not None:
        return known * [scale.slope(float(share)) for scale, share in zip(scales, shares, strict=True)]
    columns = []
    for i in range(len(scales)):
        ends = [float(np.clip(shares[i] + step, 0.0, 1.0)) for step in (-_STEP, _STEP)]
        low, high = (residuals(values_at(scales, np.where(np.arange(len(scales)) == i, end, shares))) for end in ends)
        columns.append((high - low) / (ends[1] - ends[0]))
    return np.array(columns).T


def uncertainty(scales: Sequence[Scale], shares: Float, derivative: Float, residuals: Residuals) -> FittedValues:
    """Return the values with their uncertainty, from the Jacobian (n, k) by shares and from the residuals around."""
    fisher = derivative.T @ derivative
    eigenvalues, vectors = np.linalg.eigh(fisher)
    # prior knowledge: a uniform distribution over the range, whose variance is 1/12
    covariance = (vectors / (np.maximum(eigenvalues, 0.0) + 12.0)) @ vectors.T
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    values = values_at(scales, shares)
    ends = np.array([_interval(i, scales, shares, covariance[i] / sd[i], residuals) for i in range(len(scales))])
    told = [
        *_untold(scales, eigenvalues, vectors),
        *_correlated(scales, correlation, eigenvalues),
        *_bound(scales, shares),
    ]
    stds = np.sqrt(np.mean((ends - values[:, None]) ** 2, axis=1))
    none = np.zeros(len(scales))
    return FittedValues(values, stds, ends[:, 0], ends[:, 1], correlation, shares, tuple(told), none)


def _interval(
    number: int, scales: Sequence[Scale], shares: Float, direction: Float, residuals: Residuals
) -> tuple[float, float]:
    """Return the ends of the interval of a value in which the sum of squares rises by less than one.

    `direction` (k,) is the change of the shares for one standard deviation of the value, by the covariance.
    """
    least = float(np.sum(residuals(values_at(scales, shares)) ** 2))
    ends = []
    for sign in (-1.0, 1.0):
        step = 1.0
        for _ in range(_TRIALS):
            moved = np.clip(shares + sign * step * direction, 0.0, 1.0)
            try:
                rise = float(np.sum(residuals(values_at(scales, moved)) ** 2)) - least
            except Finger3dError:
                rise = math.inf
            if abs(rise - 1.0) < _RISE_TOLERANCE or (rise < 1.0 and moved[number] in (0.0, 1.0)):
                break
            step *= min(max(1.0 / math.sqrt(max(rise, 1e-12)), 1.0 / _LARGEST_STEP), _LARGEST_STEP)
            step = max(step, 1.0 / _LARGEST_STEP)  # where the fit is poor, round-off of the minimum exceeds one
        ends.append(scales[number].value(float(moved[number])))
    return ends[0], ends[1]


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
