"""How many increments a calibration takes, and the error that they leave in the strain of its gauge.

The error of N equal increments falls about as 1/N, on the way to which N and 2N, or N and 4N, often agree by chance.
So it is told by several pairs of levels, each scaled to N, of which the largest counts.  Extrapolation in 1/N
would leave 0.4 to 1.9 of the error (validation/calibration_z_scores.py), so it is not worth its price.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from finger3d._types import Float
from finger3d.mechanics.model import Leg
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.step_halving import with_steps

SHARE = 0.1
"""Of the strain noise: an error of the increments below that asks for no more of them."""

_MOST = {"solid": 160, "plane-strain": 320, "plane-stress": 320}  # increments of a solid take ten times as long
_MOST_FACTORED = 40  # beyond small strain, where every increment factors the body anew
_LIGHT = 40  # of presses that are only compared with each other
_FEW = 40  # below, more increments cost little; from there on, fewer tell as much
_PAIRS = 2  # of levels, before an error is believed


@dataclass(frozen=True)
class Increments:
    """The increments of a calibration.

    Attributes
    ----------
    legs : with the number of increments of each
    light : the same with fewer where they were chosen, for presses that are only compared with each other
    chosen : whether their number was chosen by the error of the strain
    error : of the strain, the largest over the mu that were tried; nan where nothing was tried
    wanted : what was asked of it
    """

    legs: tuple[Leg, ...]
    light: tuple[Leg, ...]
    chosen: bool
    error: float
    wanted: float

    def as_dict(self) -> dict[str, object]:
        """Return the entry of calibration.json."""
        return {"steps": [leg.steps for leg in self.legs], "chosen": self.chosen}

    def __str__(self) -> str:
        """Number of increments, and the error of the strain."""
        steps = ", ".join(str(leg.steps) for leg in self.legs)
        met = "as asked" if self.error <= self.wanted else f"{self.wanted:.1e} was asked; more are not affordable"
        return f"{steps} increments leave an error of about {self.error:.1e} in the strain; {met}"


def error_left(strains: Mapping[float, Float], at: float) -> Float:
    """Error (m,) of the strain with `at` increments: the largest that any pair of levels tells, nan where none does.

    Parameters
    ----------
    strains : number of increments -> (m,), nan where a press failed; levels finer than `at` are compared with it
    """
    told = np.full((1, len(next(iter(strains.values())))), math.nan)
    for a, coarse in strains.items():
        for b, fine in strains.items():
            if a < b and a <= at:
                told = np.vstack([told, np.abs(coarse - fine) / (at / a - at / b)])
    return np.asarray(np.fmax.reduce(told, axis=0))


def found_increments(problem: Problem, strain: Callable[[Problem], Float], noise: float) -> Increments:
    """The increments that a path asks for, or those that it is given.

    Parameters
    ----------
    problem : whose automatic legs are doubled until their error is small beside the noise, or at the limit
    strain : problem -> (m,) at a few mu, nan where a press failed
    noise : standard deviation of a strain reading
    """
    model, wanted = problem.model, SHARE * noise
    legs = model.legs
    if all(isinstance(leg.steps, int) for leg in legs):
        return Increments(legs, legs, False, math.nan, wanted)
    most, steps = _MOST_FACTORED if model.formulation.finite_strain else _MOST[model.domain], AUTO_START
    strains: dict[float, Float] = {}
    while True:
        trial = with_steps(problem, steps)
        strains[steps] = strain(trial)
        error = error_left(strains, steps)
        small = len(strains) > _PAIRS and bool((error <= wanted).all())
        if small or 2 * steps > most:
            light = with_steps(problem, min(steps, _LIGHT)).model.legs
            return Increments(trial.model.legs, light, True, float(error.max()), wanted)
        strains = {n: s for n, s in strains.items() if 2 * n >= steps}
        steps *= 2


def _levels(problem: Problem, chosen: bool) -> tuple[float, ...]:
    """How many times as many increments tell the error of those that there are; fewer cost least."""
    if chosen:
        return 0.25, 0.5
    if problem.model.formulation.finite_strain:
        return 0.5, 2.0
    return (0.25, 0.5, 2.0) if min(int(leg.steps) for leg in problem.model.legs) >= _FEW else (2.0, 4.0, 8.0)


def times_as_many(problem: Problem, times: float) -> tuple[float, Problem]:
    """The problem with so many times as many increments, and how many times that is after rounding."""
    legs = problem.model.legs
    others = tuple(replace(leg, steps=max(1, round(times * int(leg.steps)))) for leg in legs)
    ratio = sum(int(leg.steps) for leg in others) / sum(int(leg.steps) for leg in legs)
    return ratio, replace(problem, model=replace(problem.model, legs=others))


def increment_error(problem: Problem, own: Float, chosen: bool, strain: Callable[[Problem], Float]) -> Float:
    """Error (m,) of the strain `own` (m,) by the increments of a problem, from presses of more or fewer.

    Parameters
    ----------
    chosen : whether `found_increments` chose their number
    strain : problem -> (m,), nan where a press failed
    """
    found = {1.0: own}
    for level in _levels(problem, chosen):
        ratio, other = times_as_many(problem, level)
        if ratio != 1.0:
            found[ratio] = strain(other)
    return error_left(found, 1.0)
