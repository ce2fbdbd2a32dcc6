"""Uncertainty of fitted values: the likelihood along the friction coefficient, normal in all other values.

With the Jacobian J of residuals whose covariance is the identity, and a variance of 1/12 of the range beforehand, that
of a uniform distribution, ``H = J^T J + 12`` is the Fisher matrix and its inverse the covariance of the values (Bard
1974, Ch. 7).  An eigenvector of ``J^T J`` along which the standard deviation is a quarter of the range or more is a
combination of values that the data do not determine.

What is read bends strongly with friction, and is constant where all of the contact sticks.  The press is therefore
solved at several coefficients from bound to bound.  At each the other values minimise the linearised sum of squares
chi^2, and Laplace's method gives the likelihood ``exp(-chi^2 / 2) / sqrt(det H)`` of the coefficient and a normal
distribution of the others; in between residuals and Jacobian are interpolated.  The standard deviation of a value is
its root mean square distance from the fitted one over this mixture, and the ends of its interval are quantiles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special
from scipy.interpolate import PchipInterpolator

from finger3d._types import Float
from finger3d.analyses.identify.fit import Scale, values_at
from finger3d.errors import Finger3dError

_PRIOR = 12.0
"""Inverse of the variance of a uniform distribution over the range, in shares."""

_COARSE, _FINE = np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 401)
_NEAR, _FINE_NEAR = np.array([-3.0, -1.5, 0.0, 1.5, 3.0]), np.linspace(-5.0, 5.0, 201)
"""Coefficients that are pressed, and those at which the likelihood is interpolated: as shares of the range, and near
the fitted one, in standard deviations."""

_APART = 1e-3
"""Least distance of coefficients that are pressed, in shares."""

_ROUNDS, _STILL, _NEGLIGIBLE = 3, 0.05, 1e-2
"""Largest number of times that presses follow the other values; change of a share, and part of the largest likelihood,
below which they need not."""

_UNTOLD = 0.25
"""Standard deviation of a combination, relative to the range, at which the data do not determine it."""

_LEAST_SD = 1e-12  # of a share
_STRONG = 0.95  # correlation that is named
_AT_BOUND = 1e-3  # distance of a share from 0 or 1
_PART = 0.3  # component of an eigenvector that is named
_PLAUSIBLE = np.exp(-0.5)  # of the largest likelihood: the 68 % limit of a likelihood ratio
_TAIL = 0.5 * special.erfc(np.sqrt(0.5))  # probability beyond one standard deviation, to one side


@dataclass(frozen=True)
class Mixture:
    """Normal distributions (m) of the shares (k) whose mixture is the likelihood.

    Attributes
    ----------
    shares : (m, k) means
    covariance : (m, k, k)
    weight : (m,)
    density : (m,) likelihood of the friction coefficient over its largest value
    """

    shares: Float
    covariance: Float
    weight: Float
    density: Float

    @property
    def sd(self) -> Float:
        """Standard deviations (m, k)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    def about(self, shares: Float) -> Float:
        """Return the mean squares and products (k, k) of distances from shares (k,)."""
        distance = self.shares - shares
        products = self.covariance + distance[:, :, None] * distance[:, None, :]
        return np.asarray(np.einsum("m,mij->ij", self.weight, products))

    def quantile(self, number: int, probability: float) -> float:
        """Return a quantile of a share, within its bounds."""
        middle, sd = self.shares[:, number], np.maximum(self.sd[:, number], 1e-9)

        def excess(share: float) -> float:
            return float(self.weight @ special.ndtr((share - middle) / sd)) - probability

        if excess(0.0) >= 0.0 or excess(1.0) <= 0.0:
            return 0.0 if excess(0.0) >= 0.0 else 1.0
        return float(optimize.brentq(excess, 0.0, 1.0, xtol=1e-12))


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


Press = Callable[[Float], tuple[Float, Float]]
"""Residuals (n,) at shares (k,), and their derivatives (n, k - 1) by all shares but that of friction."""


def normal(shares: Float, derivative: Float) -> Mixture:
    """Return the normal distribution about shares (k,) with the derivatives (n, k) of the residuals."""
    covariance = np.asarray(np.linalg.inv(derivative.T @ derivative + _PRIOR * np.eye(len(shares))))
    return Mixture(shares[None], covariance[None], np.ones(1), np.ones(1))


def along_friction(shares: Float, derivative: Float, friction: int, press: Press) -> Mixture:
    """Return the likelihood along the share of a number, about shares (k,) and derivatives (n, k) there."""
    best, others = shares[friction], np.arange(len(shares)) != friction
    sd = float(normal(shares, derivative).sd[0, friction])
    places = np.unique(np.clip([*_COARSE, *(best + sd * _NEAR)], 0.0, 1.0))
    places = places[np.append(True, np.diff(places) > _APART)]
    fine = np.unique(np.clip([*_FINE, *(best + sd * _FINE_NEAR)], 0.0, 1.0))
    bases = np.where(others, shares, np.where(others, 0.0, places[:, None]))
    known: dict[int, tuple[Float, Float]] = {}
    for _ in range(_ROUNDS):
        for i, base in enumerate(bases):
            if i not in known:
                try:
                    known[i] = press(base)
                except Finger3dError:
                    known[i] = np.full(len(derivative), np.nan), np.full_like(derivative[:, others], np.nan)
        good = np.array([i for i in sorted(known) if np.isfinite(known[i][0]).all()])
        fine = fine[(fine >= places[good[0]]) & (fine <= places[good[-1]])]
        residual, slope, base = (
            PchipInterpolator(places[good], np.array(values))(fine)
            for values in ([known[i][0] for i in good], [known[i][1] for i in good], bases[np.ix_(good, others)])
        )
        mixture = _laplace(fine, friction, residual, slope, base, shares[others])
        moved = np.array([np.interp(places, fine, column) for column in mixture.shares.T]).T
        counts = np.interp(places, fine, mixture.density) > _NEGLIGIBLE
        left = [i for i in good if counts[i] and np.abs(moved[i] - bases[i])[others].max(initial=0.0) > _STILL]
        for i in left:
            bases[i, others] = moved[i, others]
            del known[i]
        if not left:
            break
    return mixture


def _laplace(fine: Float, friction: int, residual: Float, slope: Float, base: Float, prior: Float) -> Mixture:
    """Return the mixture at shares (m,) of friction.

    Parameters
    ----------
    residual, slope : (m, n), (m, n, k - 1) at the other shares `base` (m, k - 1)
    prior : (k - 1,) shares that are expected beforehand
    """
    turned = slope.transpose(0, 2, 1)
    hessian = turned @ slope + _PRIOR * np.eye(len(prior))
    gradient = turned @ residual[:, :, None] + _PRIOR * (base - prior)[:, :, None]
    step = -np.linalg.solve(hessian, gradient)[:, :, 0]
    reached = np.clip(base + step, 0.0, 1.0)
    left = residual + np.einsum("mnk,mk->mn", slope, reached - base)
    chi_square = np.sum(left**2, axis=1) + _PRIOR * np.sum((reached - prior) ** 2, axis=1)
    log = -0.5 * (chi_square + np.linalg.slogdet(hessian).logabsdet)
    density = np.exp(log - log.max())
    weight = density * np.gradient(fine)
    count = len(prior) + 1
    others = np.arange(count) != friction
    shares, covariance = np.empty((len(fine), count)), np.zeros((len(fine), count, count))
    shares[:, friction], shares[:, others] = fine, reached
    covariance[np.ix_(range(len(fine)), others, others)] = np.linalg.inv(hessian)
    return Mixture(shares, covariance, weight / weight.sum(), density)


def fitted_values(
    scales: Sequence[Scale], shares: Float, derivative: Float, errors: Float, mixture: Mixture, friction: int | None
) -> FittedValues:
    """Return the values at shares (k,) with their uncertainty.

    The standard deviation of a value is the root mean square distance of the ends of one standard deviation of its
    share, within the bounds, over the mixture.

    Parameters
    ----------
    derivative : (n, k) of the residuals by shares
    errors : (n, n) part of the errors of the simulation in the covariance of the residuals
    friction : number of the share along which the mixture is
    """
    values, fisher = values_at(scales, shares), derivative.T @ derivative
    ends = (np.clip(mixture.shares + sign * mixture.sd, 0.0, 1.0) for sign in (-1.0, 1.0))
    squares = sum(0.5 * (np.array([values_at(scales, end) for end in one]) - values) ** 2 for one in ends)
    stds = np.sqrt(mixture.weight @ squares)
    low, high = (
        np.array([scale.value(choose(mixture.quantile(i, p), float(shares[i]))) for i, scale in enumerate(scales)])
        for p, choose in ((_TAIL, min), (1.0 - _TAIL, max))
    )
    covariance = normal(shares, derivative).covariance[0]
    shift = np.linalg.pinv(derivative)
    whole, part = (np.sqrt(np.diag(shift @ matrix @ shift.T)) for matrix in (np.eye(len(errors)), errors))
    slopes = np.array([scale.slope(float(share)) for scale, share in zip(scales, shares, strict=True)])
    numerical = np.minimum(slopes, stds / np.maximum(whole, _LEAST_SD)) * part
    eigenvalues, vectors = np.linalg.eigh(fisher)
    about = mixture.about(shares)
    told = [
        *_untold(scales, eigenvalues, vectors),
        *_correlated(scales, _correlation(covariance), eigenvalues),
        *_bound(scales, shares),
    ]
    if friction is not None:
        told += _along(scales[friction], mixture, friction, float(np.sqrt(about[friction, friction])))
    untold = tuple(dict.fromkeys(told))
    return FittedValues(values, stds, low, high, _correlation(about), shares, untold, numerical)


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
                found.append(_cannot_tell(scales[parts[0]]))
            else:
                same = np.sign(vector[parts]) == np.sign(vector[parts[0]])
                how = "rise together" if same.all() else "change against each other"
                found.append(f"the data cannot tell {' and '.join(names)} apart: they may {how} and fit as well")
    return found


def _cannot_tell(scale: Scale) -> str:
    return f"the data cannot tell {scale.key} within its bounds"


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


def _along(scale: Scale, mixture: Mixture, friction: int, sd: float) -> list[str]:
    """Say that the likelihood of the friction coefficient is flat, or that it has several maxima."""
    inside = np.flatnonzero(np.diff(np.pad((mixture.density >= _PLAUSIBLE).astype(int), 1))).reshape(-1, 2)
    place = mixture.shares[:, friction]
    ranges = [f"{scale.value(place[a]):.3g} to {scale.value(place[b - 1]):.3g}" for a, b in inside]
    found = [f"{scale.key} = {' and '.join(ranges)} fit about as well"] if len(ranges) > 1 else []
    return [*found, _cannot_tell(scale)] if sd > _UNTOLD else found
