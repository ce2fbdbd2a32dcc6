"""Friction coefficient from one or more readings: the likelihood of mu, and a test whether any mu explains them.

At every mu, the deviations z of the tolerances that readings r share are marginalised by Laplace's method.  With the
residual ``d = r - e(mu) - S z - C z^2 / 2`` of the forward model, the likelihood is ``exp(-chi^2 / 2) / sqrt(det D det
H)``, where ``chi^2 = d^T D^-1 d + z^T z`` is the least over z, and ``H = 1 + J^T D^-1 J`` with ``J = S + C z`` is its
Hessian by Gauss and Newton.  Without curvatures C this is the normal distribution with the covariance ``D + S S^T``.

The estimate is the mu with the least chi-square, so that a reading of the calibration curve gives the mu it is of.
Normalised over the calibrated range the likelihood gives the standard deviation, the root mean square distance of mu
from the estimate, and the smallest set that holds 90 % (a credible set for a mu that may lie anywhere in the range).
Where the likelihood has several peaks, that set is several intervals, all of which are reported.

The smallest chi-square of several readings of one press follows a chi-square distribution with one degree of freedom
less than there are readings; that of a single reading is at most as large as with one degree of freedom. Readings with
a p-value below 0.001 are out of range, or contradict each other.

The Fisher information of readings that nobody has taken yet marginalises the tolerances.  The unknowns are mu and the
tolerances that all readings share, each in units of its standard deviation.  A reading with slope s against mu, effects
f of the shared tolerances, and variance d of its own adds ``v v^T / d`` with v = (s, f) to the Fisher matrix.  The
information about mu alone is the Schur complement of the other unknowns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from finger3d._types import Float
from finger3d.sensor.curve import Errors, SensorModel

Status = Literal["ok", "coarse", "ambiguous", "above", "below", "outside", "blind", "contradiction"]

CREDIBLE = 0.9
"""Share of the likelihood in the reported set."""

LEAST_P = 1e-3
"""Probability of so large a chi-square below which no mu is said to have the readings."""

_PLAUSIBLE = math.exp(-0.5 * 2.706)  # of the largest likelihood: the 90 % limit of a likelihood ratio
_NEGLIGIBLE = 1e-12  # of the largest likelihood
_ITERATIONS, _STILL = 30, 1e-4  # of the method of Gauss and Newton; a change of z, in standard deviations, that ends it
_EQUAL = 0.1  # difference of logarithms of densities below which they are equal: on a plateau
_FINER = 8  # places of a set's ends per mu
_NODES, _ENOUGH, _ZOOMS = 400, 50, 6  # of a finer grid; where the likelihood is not negligible; grids that are tried


@dataclass(frozen=True)
class Estimate:
    """Estimate of mu from one or more readings.

    Attributes
    ----------
    readings, stds : by name; the standard deviations of their noise
    mu, std : with the least chi-square, and the root mean square distance of mu from it; nan unless the status is "ok"
        or "coarse"
    low, high : ends of the 90 % set; 0 or infinite where it reaches an end of the calibrated range
    intervals : of the 90 % set, ascending
    status : ok; coarse: worse than the calibration's limit; ambiguous: several intervals; above, below: beyond the end
        of the range in which mu is resolved; blind: no mu is resolved; outside: no mu has these readings;
        contradiction: they are not of one press
    chi_square, p_value : of the test that a calibrated mu explains the readings
    verdict : the same in words
    """

    readings: Mapping[str, float]
    stds: Mapping[str, float]
    mu: float
    std: float
    low: float
    high: float
    intervals: tuple[tuple[float, float], ...]
    status: Status
    chi_square: float
    p_value: float
    verdict: str

    @property
    def is_determined(self) -> bool:
        """Whether the readings determine mu, to the limit of the calibration or worse."""
        return self.status in ("ok", "coarse")


@dataclass(frozen=True)
class _Likelihood:
    """Likelihood on ascending mu (m,): its density, normalised, and chi-square."""

    mu: Float
    density: Float
    chi_square: Float

    @classmethod
    def of(cls, mu: Float, residual: Float, errors: Errors) -> _Likelihood:
        """Return the likelihood of residuals (m, k) at z = 0."""
        chi_square, log_determinant = _marginal(residual, errors)
        log = -0.5 * (chi_square + log_determinant)
        return cls(mu, np.exp(log - log.max()), chi_square)

    @cached_property
    def weight(self) -> Float:
        """Share (m,) of the likelihood that belongs to every mu, by the trapezoidal rule."""
        step = np.diff(self.mu)
        width = 0.5 * (np.append(step, 0.0) + np.append(0.0, step))
        weight = self.density * width
        return np.asarray(weight / weight.sum())

    @cached_property
    def best(self) -> float:
        """Mu with the least chi-square, by a parabola through three values."""
        i = int(np.argmin(self.chi_square))
        if i in (0, len(self.mu) - 1):
            return float(self.mu[i])
        near = self.mu[i - 1 : i + 2] - self.mu[i]
        c2, c1, _ = np.polyfit(near, self.chi_square[i - 1 : i + 2], 2)
        return float(self.mu[i] + (np.clip(-0.5 * c1 / c2, near[0], near[2]) if c2 > 0.0 else 0.0))

    @property
    def std(self) -> float:
        """Root mean square distance of mu from the best."""
        return math.sqrt(float(self.weight @ (self.mu - self.best) ** 2))

    def reaches_ends(self, mu: Float) -> tuple[bool, bool]:
        """Return whether the first and the last calibrated mu are plausible: beyond them mu may lie as well."""
        first, last = self.mu[0] == mu[0], self.mu[-1] == mu[-1]
        return bool(first and self.density[0] >= _PLAUSIBLE), bool(last and self.density[-1] >= _PLAUSIBLE)

    def credible_set(self) -> tuple[tuple[float, float], ...]:
        """Return the intervals of the smallest set that holds `CREDIBLE` of the likelihood.

        The logarithm of the density is linear between the mu, of which a set may hold few.
        """
        nodes = np.arange(len(self.mu))
        places = np.linspace(0.0, nodes[-1], _FINER * nodes[-1] + 1)
        log = np.interp(places, nodes, np.log(np.maximum(self.density, np.finfo(float).tiny)))
        fine = _Likelihood(np.interp(places, nodes, self.mu), np.exp(log), np.zeros_like(log))
        level = np.round(log / _EQUAL)
        order = np.lexsort((np.abs(fine.mu - fine.mu[np.argmax(level)]), -level))  # of equals the nearest to the mode
        count = int(np.searchsorted(np.cumsum(fine.weight[order]), CREDIBLE)) + 1
        inside = np.zeros(len(order) + 2, dtype=int)
        inside[1 + order[:count]] = 1
        ends = np.flatnonzero(np.diff(inside)).reshape(-1, 2)
        return tuple((float(fine.mu[a]), float(fine.mu[b - 1])) for a, b in ends)


def _marginal(residual: Float, errors: Errors) -> tuple[Float, Float]:
    """Return the least chi-square (m,) over the shared tolerances, and the log of det D det H, but for a constant."""
    slope, curvature, weight = errors.slope, errors.curvature, 1.0 / errors.variance
    count, _, tolerances = slope.shape
    z, chi_square, log_determinant = np.zeros((count, tolerances)), np.full(count, np.inf), np.zeros(count)
    left = np.arange(count)  # the mu at which z still changes
    for _ in range(_ITERATIONS if curvature.any() else 2):  # the least of a quadratic form is found by the first one
        s, c, w, at = slope[left], curvature[left], weight[left], z[left, None, :]
        jacobian = s + c * at
        misfit = residual[left] - np.sum((s + 0.5 * c * at) * at, axis=-1)
        weighted = jacobian.transpose(0, 2, 1) * w[:, None, :]
        hessian = np.eye(tolerances) + weighted @ jacobian
        reached = np.sum(w * misfit**2, axis=1) + np.sum(z[left] ** 2, axis=1)
        falls = reached < chi_square[left]
        chi_square[left[falls]] = reached[falls]
        log_determinant[left[falls]] = np.linalg.slogdet(hessian[falls]).logabsdet
        target = (misfit + np.sum(jacobian * at, axis=-1))[:, :, None]
        z[left] = np.linalg.solve(hessian, weighted @ target)[:, :, 0]
        left = left[np.abs(z[left] - at[:, 0]).max(axis=1, initial=0.0) > _STILL]
    return chi_square, log_determinant - np.sum(np.log(weight / weight[0]), axis=1)


@dataclass(frozen=True)
class Estimator:
    """Estimates from readings of one kind and noise.

    Attributes
    ----------
    limit : standard deviation of mu beyond which an estimate is called coarse
    noise : (k,)
    """

    model: SensorModel
    limit: float
    noise: tuple[float, ...]

    @cached_property
    def _on_grid(self) -> tuple[Float, Errors]:
        return self._at(self.model.grid)

    def _at(self, mu: Float) -> tuple[Float, Errors]:
        """Return the readings (m, k) at mu (m,) without errors, and the errors."""
        return self.model.at(mu), self.model.errors(mu, np.array(self.noise))

    def estimate(self, reading: Float) -> Estimate:
        """Return the estimate from readings (k,)."""
        likelihood = self._likelihood(reading)
        chi_square = float(likelihood.chi_square.min())
        freedom = max(1, len(reading) - 1)
        p_value = chi_square_tail(chi_square, freedom)
        intervals = likelihood.credible_set()
        status = self._status(likelihood, p_value, len(intervals))
        c = self.model
        below, above = likelihood.reaches_ends(c.mu)
        determined = status in ("ok", "coarse")
        none = status in ("outside", "contradiction")
        return Estimate(
            readings=dict(zip(c.names, map(float, reading), strict=True)),
            stds=dict(zip(c.names, map(float, self.noise), strict=True)),
            mu=likelihood.best if determined else math.nan,
            std=likelihood.std if determined else math.nan,
            low=math.nan if none else 0.0 if below else intervals[0][0],
            high=math.nan if none else math.inf if above else intervals[-1][1],
            intervals=() if none else intervals,
            status=status,
            chi_square=chi_square,
            p_value=p_value,
            verdict=self._verdict(status, likelihood, intervals, reading, p_value),
        )

    def _likelihood(self, reading: Float) -> _Likelihood:
        """Return the likelihood on the grid, or on a finer one around a peak that the grid does not resolve."""
        mu = self.model.grid
        for _ in range(_ZOOMS):
            nominal, errors = self._on_grid if mu is self.model.grid else self._at(mu)
            likelihood = _Likelihood.of(mu, reading - nominal, errors)
            good = np.flatnonzero(likelihood.density >= _NEGLIGIBLE)
            if len(good) >= _ENOUGH:
                break
            mu = np.linspace(mu[max(good[0] - 1, 0)], mu[min(good[-1] + 1, len(mu) - 1)], _NODES)
        return likelihood

    def _status(self, likelihood: _Likelihood, p_value: float, intervals: int) -> Status:
        mu = self.model.mu
        if p_value < LEAST_P:
            return "outside" if likelihood.best in (mu[0], mu[-1]) or len(self.noise) == 1 else "contradiction"
        below, above = likelihood.reaches_ends(mu)
        if intervals > 1:
            return "ambiguous"
        if below and above:
            return "blind"
        if above:
            return "above"
        if below:
            return "below"
        return "coarse" if likelihood.std > self.limit else "ok"

    def _verdict(
        self,
        status: Status,
        likelihood: _Likelihood,
        intervals: tuple[tuple[float, float], ...],
        reading: Float,
        p_value: float,
    ) -> str:
        mu = self.model.mu
        first, last, low, high = mu[0], mu[-1], intervals[0][0], intervals[-1][1]
        these = "this reading" if len(reading) == 1 else "these readings"
        if status == "contradiction":
            return self._contradiction(likelihood, reading, p_value)
        if status == "outside":
            or_else = "" if len(reading) == 1 else ", or they contradict each other"
            return (
                f"out of range: no mu from {first:g} to {last:g} has {these}{or_else}; the nearest, mu = "
                f"{likelihood.best:.3g}, is {math.sqrt(likelihood.chi_square.min()):.2g} standard deviations away "
                f"(p = {p_value:.1g})"
            )
        if status == "ambiguous":
            return f"ambiguous: {ranges_text(intervals)} hold {100.0 * CREDIBLE:.0f} % of the likelihood"
        if status == "blind":
            reductions = {name: float(values[0]) for name, values in self.model.reductions([likelihood.best]).items()}
            largest = max(reductions, key=lambda name: reductions[name])
            return (
                f"out of range: every mu from {first:g} to {last:g} is plausible"
                + f"; {100.0 * reductions[largest]:.0f} % of the variance is from {largest}"
                * (reductions[largest] > 0.0)
            )
        if status == "above":
            return f"out of range: mu > {low:.3g}, and the calibration ends at {last:g}"
        if status == "below":
            return f"out of range: mu < {high:.3g}, and the calibration begins at {first:g}"
        text = f"mu = {likelihood.best:.3g} +- {likelihood.std:.2g} (90 % interval {low:.3g} to {high:.3g})"
        return text if status == "ok" else f"{text}: coarser than the limit of {self.limit:g}"

    def _contradiction(self, likelihood: _Likelihood, reading: Float, p_value: float) -> str:
        """Return the verdict that readings contradict each other, and without which one the others agree."""
        text = ""
        for name in self.model.names if len(reading) > 2 else ():
            others = [j for j, other in enumerate(self.model.names) if other != name]
            model, noise = self.model.of([self.model.names[j] for j in others]), tuple(self.noise[j] for j in others)
            part = Estimator(model, self.limit, noise).estimate(reading[others])
            if part.p_value >= LEAST_P:
                text += f"; without {name}: {part.verdict}"
        return (
            f"these readings contradict each other: chi-square {likelihood.chi_square.min():.3g} with "
            f"{len(reading) - 1} degree{'s' if len(reading) > 2 else ''} of freedom (p = {p_value:.1g}){text}"
        )


@lru_cache(maxsize=8)
def estimator(model: SensorModel, limit: float, noise: tuple[float, ...]) -> Estimator:
    """Return the estimator for readings with noise (k,); a few are kept, so that readings one by one are quick."""
    return Estimator(model, limit, noise)


def ranges_text(intervals: Sequence[tuple[float, float]]) -> str:
    """Return intervals of mu in words."""
    return ", ".join(f"mu = {low:.3g} to {high:.3g}" for low, high in intervals) or "nowhere"


def chi_square_tail(value: float, freedom: int) -> float:
    """Return the probability that chi-square exceeds a value (Abramowitz and Stegun 1964, Eqs. 26.4.4 and 26.4.5)."""
    half = 0.5 * value
    if freedom % 2 == 0:
        term = total = 1.0
        for i in range(1, freedom // 2):
            term *= half / i
            total += term
        return math.exp(-half) * total
    term, total = math.sqrt(half) * 2.0 / math.sqrt(math.pi), 0.0
    for i in range(1, (freedom + 1) // 2):
        total += term
        term *= half / (i + 0.5)
    return math.erfc(math.sqrt(half)) + math.exp(-half) * total


@dataclass(frozen=True)
class ReadingEffects:
    """Effects of mu and tolerances on candidates for a reading (c), at several mu (m).

    Attributes
    ----------
    effects : (c, m, 1 + q) slope against mu, and change for one standard deviation of each shared tolerance
    variance : (c, m) of the noise and of what every reading has of its own
    """

    effects: Float
    variance: Float

    @property
    def fisher(self) -> Float:
        """Fisher matrices (c, m, 1 + q, 1 + q) of the candidates."""
        v = self.effects
        return np.asarray(v[..., :, None] * v[..., None, :] / self.variance[..., None, None])


def prior(shared: int, mu_sd: float) -> Float:
    """Return the Fisher matrix (1 + q, 1 + q) without readings; `mu_sd` is what is known of mu beforehand."""
    return np.diag([mu_sd**-2, *np.ones(shared)])


def mu_sd(fisher: Float) -> Float:
    """Return the standard deviation (...) of mu from Fisher matrices (..., 1 + q, 1 + q)."""
    information, mixed, others = fisher[..., 0, 0], fisher[..., 1:, 0], fisher[..., 1:, 1:]
    if not mixed.shape[-1]:
        return np.asarray(1.0 / np.sqrt(information))
    left = information - np.einsum("...i,...i->...", mixed, np.linalg.solve(others, mixed[..., None])[..., 0])
    return np.asarray(1.0 / np.sqrt(left))
