"""Friction coefficient from a strain: the values of mu that are consistent with a reading.

With a standard deviation s(mu) of a reading about the curve e(mu), the 68 % set of a strain is ``|strain - e(mu)| <=
s(mu)``: it holds the true mu as often as a normal error stays within one standard deviation, whatever the curve looks
like (the inversion of a test, Neyman 1937).  Where the curve is not monotone, it may be two intervals, both reported.

The standard deviation of mu is the root mean square distance from the reported value, over the likelihood of mu in the
calibrated range, ``exp(-((strain - e(mu)) / s(mu))^2 / 2) / s(mu)``.  On a straight curve that is ``s / |de/dmu|``.
Near a flat part of the curve it includes the spread there, since noise may move a reading from a flat to a steep part.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.sensor.curve import LARGEST_STRAIN, Calibration, Shape

Status = Literal["ok", "coarse", "ambiguous", "above", "below", "outside", "blind"]

_CHUNK = 256  # readings at a time: each is compared with the whole grid
_MERGE_TOLERANCE = 1e-9
_LEAST_SD = 1e-12  # of strain, where nothing is uncertain
_MARGIN, _NODES = 4.0, 129  # of integrals over an interval: margin on each side, in its widths, and nodes


@dataclass(frozen=True)
class Candidate:
    """Candidate of mu with its standard deviation and its 68 % interval."""

    mu: float
    std: float
    low: float
    high: float


@dataclass(frozen=True)
class Estimate:
    """Estimate of mu from a reading.

    Attributes
    ----------
    strain, reading_std : the reading
    mu, std : nan unless the status is "ok" or "coarse"; std is the spread of the likelihood about mu
    low, high : ends of the 68 % set; infinite or 0 where the calibration does not reach, nan where it is empty
    status : ok; coarse: worse than the calibration's limit; ambiguous: several answers; above, below: beyond the end of
        the range in which mu is resolved; blind: no mu is resolved; outside: no mu has this strain
    verdict : the same in words
    candidates : one for each interval of the 68 % set
    """

    strain: float
    reading_std: float
    mu: float
    std: float
    low: float
    high: float
    status: Status
    verdict: str
    candidates: tuple[Candidate, ...]


def gauge_estimates(
    calibration: Calibration,
    strain: ArrayLike | None,
    std: ArrayLike | None = None,
    curve: Shape = "interpolation",
    tolerances: bool = True,
) -> list[Estimate]:
    """Return an estimate for each strain reading of a gauge; see `finger3d.sensor.estimate`."""
    readings = np.atleast_1d(np.asarray(strain, dtype=float)).ravel()
    _check("strain", readings, -LARGEST_STRAIN)
    noise = _noise(calibration, readings, std)
    calibration = calibration if tolerances else replace(calibration, tolerances=())
    found: list[Estimate] = []
    for start in range(0, len(readings), _CHUNK):
        part = slice(start, start + _CHUNK)
        found += _estimates(calibration, readings[part], noise[part], curve)
    return found


def _noise(calibration: Calibration, readings: Float, std: ArrayLike | None) -> Float:
    """Return the standard deviation of every reading (m,)."""
    given = np.asarray(calibration.noise if std is None else std, dtype=float)
    try:
        noise = np.broadcast_to(given, readings.shape)
    except ValueError:
        raise Finger3dError(
            f"std: {given.size} of them for {readings.size} strains; give one for all, or each"
        ) from None
    _check("std", noise, 0.0)
    return noise


def _check(name: str, values: Float, least: float) -> None:
    """Raise an error for values (m,) outside the range from `least` to `LARGEST_STRAIN`, and for NaN."""
    bad = ~((values >= least) & (values <= LARGEST_STRAIN))
    if bad.any():
        i = int(np.argmax(bad))
        where = f" (reading {i + 1} of {len(values)})" if len(values) > 1 else ""
        wanted = f"a finite number from {least:g} to {LARGEST_STRAIN:g}"
        raise Finger3dError(f"{name} = {values[i]}{where}: must be {wanted}")


def _estimates(calibration: Calibration, strain: Float, noise: Float, shape: Shape) -> list[Estimate]:
    grid, curve = calibration.grid, calibration.at(calibration.grid, shape)
    spread = calibration.reading_sd(grid, 0.0, shape)
    sd = np.hypot(noise[:, None], spread)
    residual = strain[:, None] - curve
    low, high = _consistent_parts(residual, sd)
    return [
        _estimate(calibration, strain[i], noise[i], _merge_intervals(grid, low[i], high[i]), residual[i], sd[i], shape)
        for i in range(len(strain))
    ]


def _consistent_parts(residual: Float, sd: Float) -> tuple[Float, Float]:
    """Return the ends (m, cells), as shares of each grid cell, of the part where |residual| <= sd; low > high if empty.

    Both are linear within a cell, so that residual <= sd and -residual <= sd each hold on one side of a point.
    """
    low, high = np.zeros(residual[:, 1:].shape), np.ones(residual[:, 1:].shape)
    for excess in (residual - sd, -residual - sd):
        a, b = excess[:, :-1], excess[:, 1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.where(a == b, 0.0, a / (a - b))
        low = np.where((a > 0.0) & (b <= 0.0), np.maximum(low, root), low)
        high = np.where((a <= 0.0) & (b > 0.0), np.minimum(high, root), high)
        low = np.where((a > 0.0) & (b > 0.0), 2.0, low)
    return low, high


def _merge_intervals(grid: Float, low: Float, high: Float) -> list[tuple[float, float]]:
    """Return intervals of mu, with those of neighbouring cells joined."""
    found: list[tuple[float, float]] = []
    step = np.diff(grid)
    for i in np.flatnonzero(low <= high):
        a, b = float(grid[i] + low[i] * step[i]), float(grid[i] + high[i] * step[i])
        if found and a - found[-1][1] <= _MERGE_TOLERANCE * step[i]:
            found[-1] = (found[-1][0], b)
        else:
            found.append((a, b))
    return found


def _candidates(grid: Float, found: list[tuple[float, float]], residual: Float, sd: Float) -> Iterator[Candidate]:
    """Yield a candidate for each interval, with its share of the likelihood, divided at the minima."""
    cuts = [float(grid[0])]
    for (_, before), (after, _) in pairwise(found):
        first, last = np.searchsorted(grid, [before, after])
        between = grid[first:last]
        deviation = np.abs(residual[first:last]) / np.maximum(sd[first:last], _LEAST_SD)
        cuts.append(float(between[np.argmax(deviation)]) if len(between) else 0.5 * (before + after))
    cuts.append(float(grid[-1]))
    for ends, part in zip(found, pairwise(cuts), strict=True):
        mu = _point_estimate(grid, ends, residual, sd)
        yield Candidate(mu, _rms_deviation(grid, mu, ends, part, residual, sd), *ends)


def _rms_deviation(
    grid: Float, mu: float, ends: tuple[float, float], part: tuple[float, float], residual: Float, sd: Float
) -> float:
    """Return the root mean square distance from mu, weighted with the likelihood in a part of the grid."""
    (low, high), (first, last) = ends, part
    margin = _MARGIN * (high - low)
    near = np.linspace(max(first, low - margin), min(last, high + margin), _NODES)
    at = np.sort(np.concatenate([part, near, grid[(grid > first) & (grid < last)]]))
    std = np.maximum(np.interp(at, grid, sd), _LEAST_SD)
    weight = np.exp(-0.5 * (np.interp(at, grid, residual) / std) ** 2) / std
    total = float(np.trapezoid(weight, at))
    return math.sqrt(float(np.trapezoid(weight * (at - mu) ** 2, at)) / total) if total else 0.5 * (high - low)


def _point_estimate(grid: Float, ends: tuple[float, float], residual: Float, sd: Float) -> float:
    """Return the point estimate of mu in an interval: where the curve has the strain, else where it is nearest."""
    low, high = ends
    first, last = np.searchsorted(grid, [low, high])
    at = np.concatenate([[low], grid[first:last], [high]])
    values = np.interp(at, grid, residual)
    cross = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) <= 0.0)
    if len(cross):
        roots = [_root(at[i], at[i + 1], values[i], values[i + 1]) for i in cross]
        return float(np.mean([roots[0], roots[-1]]))
    return float(at[np.argmin(np.abs(values) / np.maximum(np.interp(at, grid, sd), _LEAST_SD))])


def _root(a: float, b: float, at_a: float, at_b: float) -> float:
    return a if at_a == at_b else a + (b - a) * at_a / (at_a - at_b)


def _estimate(
    calibration: Calibration,
    strain: float,
    noise: float,
    intervals: list[tuple[float, float]],
    residual: Float,
    sd: Float,
    shape: Shape,
) -> Estimate:
    """Return the estimate of one reading from its intervals of mu.

    Parameters
    ----------
    residual, sd : (m,) reading minus curve on the grid of the calibration, and its standard deviation
    """
    first, last = float(calibration.mu[0]), float(calibration.mu[-1])
    candidates = tuple(_candidates(calibration.grid, intervals, residual, sd)) if intervals else ()
    low = high = math.nan
    if intervals:
        low = 0.0 if intervals[0][0] <= first else intervals[0][0]
        high = math.inf if intervals[-1][1] >= last else intervals[-1][1]
    status = _status(candidates, low, high, calibration.limit)
    if status == "outside":
        verdict = _outside_verdict(calibration, residual, sd)
    elif status == "ambiguous":
        verdict = _ambiguous_verdict(calibration, candidates, shape)
    else:
        verdict = _interval_verdict(calibration, status, candidates[0])
    known = status in ("ok", "coarse")
    return Estimate(
        strain=float(strain),
        reading_std=float(noise),
        mu=candidates[0].mu if known else math.nan,
        std=candidates[0].std if known else math.nan,
        low=low,
        high=high,
        status=status,
        verdict=verdict,
        candidates=candidates,
    )


def _status(candidates: tuple[Candidate, ...], low: float, high: float, limit: float) -> Status:
    if not candidates:
        return "outside"
    if len(candidates) > 1:
        return "ambiguous"
    if low == 0.0 and high == math.inf:
        return "blind"
    if high == math.inf:
        return "above"
    if low == 0.0:
        return "below"
    return "coarse" if candidates[0].std > limit else "ok"


def _outside_verdict(calibration: Calibration, residual: Float, sd: Float) -> str:
    """Return the verdict on a strain that no mu has."""
    deviation = np.abs(residual) / np.maximum(sd, _LEAST_SD)
    i = int(np.argmin(deviation))
    return (
        f"out of range: no mu from {calibration.mu[0]:g} to {calibration.mu[-1]:g} has this strain; it lies "
        f"{deviation[i]:.2g} standard deviations {'above' if residual[i] > 0.0 else 'below'} the nearest, "
        f"at mu = {calibration.grid[i]:.3g}"
    )


def _ambiguous_verdict(calibration: Calibration, candidates: tuple[Candidate, ...], shape: Shape) -> str:
    """Return the verdict on a strain that several mu have."""
    names = " or ".join(_candidate_text(c, float(calibration.mu[0]), float(calibration.mu[-1])) for c in candidates)
    steps = np.sign(np.diff(calibration.at(calibration.grid, shape)))
    turns = bool((steps > 0.0).any() and (steps < 0.0).any())
    why = "the curve is not monotone" if turns else "what is not known exactly reaches that far"
    return f"ambiguous: {names}; {why}"


def _interval_verdict(calibration: Calibration, status: Status, best: Candidate) -> str:
    """Return the verdict on a strain with one interval of mu."""
    first, last, limit = calibration.mu[0], calibration.mu[-1], calibration.limit
    if status == "blind":
        text = f"out of range: no mu from {first:g} to {last:g} can be told apart by this strain"
        return text + _dominant_tolerance(calibration, best.mu)
    if status in ("above", "below"):
        side, edge, end = (">", best.low, last) if status == "above" else ("<", best.high, first)
        if 0.5 * (best.high - best.low) <= limit:
            return f"out of range: mu {side} {edge:.3g}, and the calibration ends at {end:g}"
        return f"out of range: the strain at mu {side} {edge:.3g} cannot be told apart"
    text = f"mu = {best.mu:.3g} +- {best.std:.2g} (68 % interval {best.low:.3g} to {best.high:.3g})"
    return text if status == "ok" else f"{text}: coarser than the limit of {limit:g}"


def _dominant_tolerance(calibration: Calibration, mu: float) -> str:
    """Return the tolerance with the largest effect, unless it is the noise."""
    name, share = max(calibration.shares(mu).items(), key=lambda item: item[1])
    return f"; {100.0 * share:.0f} % of the variance is from {name}" if name not in ("noise", "curve") else ""


def _candidate_text(candidate: Candidate, first: float, last: float) -> str:
    if candidate.high >= last:
        return f"mu > {candidate.low:.3g}"
    if candidate.low <= first:
        return f"mu < {candidate.high:.3g}"
    return f"mu = {candidate.mu:.3g} +- {candidate.std:.2g}"
