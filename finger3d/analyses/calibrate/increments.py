"""Number of increments of a calibration, and the error that they leave in its readings.

Readings in N and 2 N increments are compared, as in `finger3d.mechanics.march.step_halving`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from finger3d._types import Float
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.step_halving import automatic, increment_error, with_scaled_steps, with_steps
from finger3d.mechanics.model import Leg
from finger3d.mechanics.path import AUTO_START

NOISE_SHARE = 0.1
"""Error of the increments, relative to the noise of a reading, at which no more increments are added."""

_LARGEST = {"solid": 160, "plane-strain": 320, "plane-stress": 320}
"""Largest number of increments of a leg; an increment of a solid takes ten times as long."""

_LARGEST_IF_FACTORED = 40
"""Largest number of increments of a leg in finite strain, where each factors the stiffness."""

Read = Callable[[Problem], Float]
"""Array of readings of a problem, of one sensor or several at some values of mu; NaN where a press failed."""


@dataclass(frozen=True)
class Increments:
    """Increments of a calibration.

    Attributes
    ----------
    legs : path with the number of increments of each leg
    chosen : whether the number was chosen by the error of the readings
    error : error of the readings relative to their noise, the largest over the values of mu that were tried; NaN if
        none was
    """

    legs: tuple[Leg, ...]
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


def choose_increments(problem: Problem, read: Read) -> Increments:
    """Return the given increments of a path, or double automatic ones until their error is small relative to the noise.

    Automatic ones are kept, too, where the path depends on the increments.

    Parameters
    ----------
    problem : Problem
    read : callable
        Returns readings over the standard deviation of their noise.
    """
    model, steps = problem.model, AUTO_START
    if not automatic(model):
        return Increments(with_steps(problem, steps).model.legs, False, math.nan)
    largest = _LARGEST_IF_FACTORED if model.finite_strain else _LARGEST[model.domain]
    readings, error = read(with_steps(problem, steps)), math.inf
    while not error <= NOISE_SHARE and 2 * steps <= largest:
        steps *= 2
        before, readings = readings, read(with_steps(problem, steps))
        error = float(increment_error(readings, before, 0.5).max())
    return Increments(with_steps(problem, steps).model.legs, True, error)


def error_of_increments(problem: Problem, own: Float, chosen: bool, read: Read) -> Float:
    """Return the error of readings due to the increments, from presses in half or twice as many.

    Parameters
    ----------
    problem : Problem
    own : array
        Readings in the increments of the problem.
    chosen : bool
        Whether `choose_increments` chose their number; half as many then suffice.
    read : callable
    """
    other, ratio = with_scaled_steps(problem, 0.5 if chosen else 2.0)
    return increment_error(own, read(other), ratio)
