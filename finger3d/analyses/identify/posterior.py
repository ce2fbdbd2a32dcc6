"""Posterior distribution of the free keys, and the uncertainty of fitted values.

Beforehand all shares of the ranges are equally likely.  Samples of the posterior are drawn by sequential Monte Carlo
(Del Moral, Doucet and Jasra 2006): samples of the prior are weighted with rising powers of the likelihood, resampled,
and moved by differences of other samples (ter Braak 2006), so that flat likelihoods and those with several maxima are
followed as well as narrow ones.  The standard deviation of a value is its root mean square distance from the fitted one
over the samples, and the ends of its interval are quantiles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special
from scipy.stats import qmc

from finger3d._types import Float
from finger3d.analyses.free_keys import FreeKey, values_at

_EFFECTIVE = 0.5
"""Effective share of the samples that is left by a rise of the power."""

_MOVES, _JUMP, _JITTER = 8, 4, 1e-5
"""Moves after each rise; of them, each fourth by a whole difference, which leads from one maximum to another; and
standard deviation that is added, in shares."""

_SEED = 2006

_UNTOLD = 0.25
"""Standard deviation of a combination, relative to the range, at which the data do not determine it."""

_STRONG = 0.95  # correlation that is named
_AT_BOUND = 1e-3  # distance of a share from 0 or 1
_PART = 0.3  # component of an eigenvector that is named
_BINS, _PLAUSIBLE = 40, 1.0
"""Bins of a share; chi-square beyond the least one at the 68 % limit of a likelihood ratio, and twice it between two
ranges that are apart."""

_TO_BOUND = 0.05  # distance of a share from a bound, and deviation of one, from which the data tell nothing beyond it
_TAIL = 0.5 * special.erfc(np.sqrt(0.5))  # probability beyond one standard deviation, to one side

LogLikelihood = Callable[[Float], Float]
"""Logarithm of the likelihood (s,) at shares (s, k), without a constant."""


@dataclass(frozen=True)
class Samples:
    """Equally weighted samples of the posterior distribution.

    Attributes
    ----------
    shares : (s, k)
    log_likelihood : (s,)
    """

    shares: Float
    log_likelihood: Float

    def about(self, shares: Float) -> Float:
        """Return the mean squares and products (k, k) of distances from shares (k,)."""
        distance = self.shares - shares
        return np.asarray(distance.T @ distance / len(distance))


def sampled(log_likelihood: LogLikelihood, dimension: int, count: int) -> Samples:
    """Return samples of the posterior, the same in each call; `count` is a power of 2."""
    random = np.random.default_rng(_SEED)
    shares = qmc.Sobol(dimension, rng=_SEED).random(count)
    found, power = log_likelihood(shares), 0.0
    while power < 1.0:
        rise = _rise(found, 1.0 - power)
        power += rise
        weight = special.softmax(rise * found)
        places = (random.random() + np.arange(count)) / count
        chosen = np.minimum(np.searchsorted(np.cumsum(weight), places), count - 1)
        shares, found = shares[chosen], found[chosen]
        for move in range(_MOVES):
            gamma = 1.0 if move % _JUMP == _JUMP - 1 else 2.38 / math.sqrt(2.0 * dimension)
            first, second = random.integers(count, size=(2, count))
            proposed = shares + gamma * (shares[first] - shares[second]) + random.normal(0.0, _JITTER, shares.shape)
            after = np.full(count, -np.inf)
            inside = ((proposed >= 0.0) & (proposed <= 1.0)).all(axis=1)
            if inside.any():
                after[inside] = log_likelihood(proposed[inside])
            taken = np.log(random.random(count)) < power * (after - found)
            shares, found = np.where(taken[:, None], proposed, shares), np.where(taken, after, found)
    return Samples(shares, found)


def _rise(log_likelihood: Float, most: float) -> float:
    """Return the rise of the power, at most `most`, that leaves the effective share of the samples."""

    def excess(rise: float) -> float:
        weight = special.softmax(rise * log_likelihood)
        return float(1.0 / (weight @ weight)) - _EFFECTIVE * len(weight)

    return most if excess(most) >= 0.0 else float(optimize.brentq(excess, 0.0, most, xtol=1e-12 * most, rtol=1e-6))


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


def fitted_values(
    free: Sequence[FreeKey], shares: Float, samples: Samples, derivative: Float, errors: Float
) -> FittedValues:
    """Return the values at shares (k,) with their uncertainty.

    Parameters
    ----------
    derivative : (n, k) of the residuals, whose covariance is the identity, by shares
    errors : (n, n) part of the errors of the simulation in that covariance
    """
    values = values_at(free, shares)
    sampled_values = np.array([values_at(free, one) for one in samples.shares])
    stds = np.sqrt(np.mean((sampled_values - values) ** 2, axis=0))
    low, high = np.quantile(sampled_values, [_TAIL, 1.0 - _TAIL], axis=0)
    shift = np.linalg.pinv(derivative)
    whole, part = (np.sqrt(np.diag(shift @ matrix @ shift.T)) for matrix in (np.eye(len(errors)), errors))
    numerical = stds * np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0)
    about = samples.about(samples.shares.mean(axis=0))
    correlation = _correlation(samples.about(shares))
    told = [*_untold(free, about), *_correlated(free, _correlation(about), about), *_bound(free, shares)]
    for number, key in enumerate(free):
        told += _maxima(key, samples, number)
    low, high = np.minimum(low, values), np.maximum(high, values)
    return FittedValues(values, stds, low, high, correlation, shares, tuple(dict.fromkeys(told)), numerical)


def _correlation(covariance: Float) -> Float:
    sd = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(sd, sd))


def _untold(free: Sequence[FreeKey], covariance: Float) -> list[str]:
    """Name the values, or combinations of them, that the data do not determine."""
    found = []
    values, vectors = np.linalg.eigh(covariance)
    for value, vector in zip(values, vectors.T, strict=True):
        if value >= _UNTOLD**2:
            parts = [i for i in np.argsort(-np.abs(vector)) if abs(vector[i]) >= _PART]
            names = [free[i].key for i in parts]
            if len(names) == 1:
                found.append(f"the data cannot tell {names[0]} within its bounds")
            else:
                same = np.sign(vector[parts]) == np.sign(vector[parts[0]])
                how = "rise together" if same.all() else "change against each other"
                found.append(f"the data cannot tell {' and '.join(names)} apart: they may {how} and fit as well")
    return found


def _correlated(free: Sequence[FreeKey], correlation: Float, covariance: Float) -> list[str]:
    """Name pairs of values that are known much better together than each alone."""
    if np.linalg.eigvalsh(covariance).max() >= _UNTOLD**2:
        return []
    pairs = [(i, j) for i in range(len(free)) for j in range(i) if abs(correlation[i, j]) > _STRONG]
    told = [f"{free[j].key} and {free[i].key} are correlated by {correlation[i, j]:.3f}" for i, j in pairs]
    return [f"{pair}: fix one, and the other is known better" for pair in told]


def _bound(free: Sequence[FreeKey], shares: Float) -> list[str]:
    ends = [(key, share) for key, share in zip(free, shares, strict=True) if min(share, 1.0 - share) < _AT_BOUND]
    return [f"{key.key} is at its {'lower' if share < 0.5 else 'upper'} bound: widen it" for key, share in ends]


def _maxima(key: FreeKey, samples: Samples, number: int) -> list[str]:
    """Say that several ranges of a value fit about as well."""
    share, beyond = samples.shares[:, number], 2.0 * (samples.log_likelihood.max() - samples.log_likelihood)
    edges = np.linspace(share.min(), share.max(), _BINS + 1)
    place, least = np.clip(np.searchsorted(edges, share) - 1, 0, _BINS - 1), np.full(_BINS, np.inf)
    np.minimum.at(least, place, beyond)
    ranges = [[edges[0], edges[0]]]
    is_apart = True
    for begin, end, lost in zip(edges[:-1], edges[1:], least, strict=True):
        if lost <= _PLAUSIBLE:
            ranges = [*ranges, [begin, end]] if is_apart else [*ranges[:-1], [ranges[-1][0], end]]
        is_apart = (is_apart and lost > _PLAUSIBLE) or lost > 2.0 * _PLAUSIBLE
    ends = {"below": ranges[1][0] < _TO_BOUND, "above": ranges[-1][1] > 1.0 - _TO_BOUND}
    reaches = [end for end, at in ends.items() if at]
    if len(reaches) == 1 and share.std() > _TO_BOUND:
        return [f"the data do not bound {key.key} from {reaches[0]}"]
    texts = [f"{key.value(a):.3g} to {key.value(b):.3g}" for a, b in ranges[1:]]
    return [f"{key.key} = {' and '.join(texts)} fit about as well"] if len(texts) > 1 else []
