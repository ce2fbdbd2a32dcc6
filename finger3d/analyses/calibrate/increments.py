"""Number of increments of a calibration, and the error that they leave in its readings.

The error of N equal increments decreases about as 1/N, but the readings of N and 2N increments, or of N and 4N, often
agree by chance.  The error is therefore estimated from several pairs of runs, each scaled to N, and the largest counts.
Extrapolation in 1/N is not used: its error would be 0.4 to 1.9 times as large (``validation/calibration_z_scores.py``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from finger3d._types import Float
from finger3d.analyses.pressed_body import under
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.path import AUTO_START
from finger3d.mechanics.march.step_halving import with_steps
from finger3d.mechanics.model import Leg

NOISE_SHARE = 0.1
"""Error of the increments, relative to the noise of a reading, at which no more increments are added."""

_LARGEST = {"solid": 160, "plane-strain": 320, "plane-stress": 320}
"""Largest number of increments of a leg; an increment of a solid takes ten times as long."""

_LARGEST_IF_FACTORED = 40
"""Largest number of increments of a leg in finite strain, where each factors the stiffness."""

_COMPARISON = 40
"""Largest number of increments of presses that are only compared with each other."""

_FEW = 40
"""Number of given increments below which the error is estimated from runs with more increments only."""

_LEAST_PAIRS = 2
"""Least number of pairs of runs before an estimate is accepted."""

Read = Callable[[Problem], Float]
"""Readings (m,) of a problem, of one sensor or several at some values of mu; NaN where a press failed."""


@dataclass(frozen=True)
class Increments:
    """Increments of a calibration.

    Attributes
    ----------
    legs : path with the number of increments of each leg
    comparison_legs : path of presses that are only compared with each other; it has fewer increments if they were
        chosen
    chosen : whether the number was chosen by the error of the readings
    error : error of the readings relative to their noise, the largest over the values of mu that were tried; NaN if
        none was
    """

    legs: tuple[Leg, ...]
    comparison_legs: tuple[Leg, ...]
    chosen: bool
    error: float

    def as_dict(self) -> dict[str, object]:
        """Return the entry of calibration.json."""
        return {"steps": [leg.steps for leg in self.legs], "chosen": self.chosen}

    def __str__(self) -> str:
        """Return the number of increments and the error of the readings."""
        steps = ", ".join(str(leg.steps) for leg in self.legs)
        limit = "as asked" if self.error <= NOISE_SHARE else f"{NOISE_SHARE:g} was asked; more are not affordable"
        return f"{steps} increments leave an error of about {self.error:.2g} of the noise in the readings; {limit}"


def pairwise_error(readings: Mapping[float, Float], count: float) -> Float:
    """Return the estimated error (m,) of readings in `count` increments, the largest over pairs of runs.

    Parameters
    ----------
    readings : number of increments -> readings (m,), NaN where a press failed
        A pair counts if its smaller number is at most `count`.  The result is NaN where there is no pair.
    count : number of increments
    """
    pairs = [(a, b) for a, b in combinations(sorted(readings), 2) if a <= count]
    estimates = [np.abs(readings[a] - readings[b]) / (count / a - count / b) for a, b in pairs]
    return np.asarray(np.fmax.reduce([np.full_like(next(iter(readings.values())), math.nan), *estimates]))


def choose_increments(problem: Problem, read: Read) -> Increments:
    """Return the given increments of a path, or double automatic ones until their error is small relative to the noise.

    Parameters
    ----------
    problem : Problem
    read : callable
        Returns readings over the standard deviation of their noise.
    """
    model = problem.model
    if all(isinstance(leg.steps, int) for leg in model.legs):
        return Increments(model.legs, model.legs, False, math.nan)
    largest, steps = _LARGEST_IF_FACTORED if model.finite_strain else _LARGEST[model.domain], AUTO_START
    readings: dict[float, Float] = {}
    while True:
        trial = with_steps(problem, steps)
        readings[steps] = read(trial)
        error = pairwise_error(readings, steps)
        met = len(readings) > _LEAST_PAIRS and bool((error <= NOISE_SHARE).all())
        if met or 2 * steps > largest:
            comparison = with_steps(problem, min(steps, _COMPARISON)).model.legs
            return Increments(trial.model.legs, comparison, True, float(error.max()))
        readings = {n: s for n, s in readings.items() if 2 * n >= steps}
        steps *= 2


def _ratios(problem: Problem, chosen: bool) -> tuple[float, ...]:
    """Return the numbers of increments, relative to the problem's, from which the error is estimated."""
    if chosen:
        return 0.25, 0.5
    if problem.model.finite_strain:
        return 0.5, 2.0
    return (0.25, 0.5, 2.0) if min(int(leg.steps) for leg in problem.model.legs) >= _FEW else (2.0, 4.0, 8.0)


def scale_increments(problem: Problem, ratio: float) -> tuple[float, Problem]:
    """Return the ratio after rounding, and the problem with its numbers of increments multiplied by it."""
    legs = problem.model.legs
    scaled = tuple(replace(leg, steps=max(1, round(ratio * int(leg.steps)))) for leg in legs)
    actual = sum(int(leg.steps) for leg in scaled) / sum(int(leg.steps) for leg in legs)
    return actual, under(problem, legs=scaled)


def error_of_increments(problem: Problem, own: Float, chosen: bool, read: Read) -> Float:
    """Return the error (m,) of readings due to the increments, from presses with more or fewer of them.

    Parameters
    ----------
    problem : Problem
    own : (m,) array
        Readings in the increments of the problem.
    chosen : bool
        Whether `choose_increments` chose their number.
    read : callable
    """
    found = {1.0: own}
    for ratio in _ratios(problem, chosen):
        actual, other = scale_increments(problem, ratio)
        if actual != 1.0:
            found[actual] = read(other)
    return pairwise_error(found, 1.0)
