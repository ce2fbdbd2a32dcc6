"""Change of the numbers of a press by more increments, estimated from two further runs of the same problem.

A number x(N) of a press in N given increments is extrapolated at first order from 4 N and 8 N, and the last step of the
extrapolation determines its error::

    d = 2 x(8 N) - x(4 N) - x(N),    error of d = max(1.5 |x(8 N) - x(4 N)|, 0.15 |d|)

The error bar of the increments cannot serve as d: it is the largest of several estimates, and in most sections too
large by more than a factor of 1.5.  Counts and factors were chosen on the 60 sections of ``validation/_drawn.py`` with
the seed 2026; ``validation/advice_against_truth.py`` compares d with the truth in other scenes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from finger3d._cost import CHANGES
from finger3d.accuracy.changes import ChangeEstimate, attempted, changing_numbers, check_kind, judged, scales
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.step_halving import TOLERANCE, last_step
from finger3d.mechanics.results.history import StepResult

_COUNTS = 4, 8
"""Increments of both further runs over those of the press."""

_SAFETY, _LEAST_ERROR = 1.5, 0.15
"""Error of a change over the difference of both runs, and least error relative to the change."""


def may_matter(numbers: Mapping[str, float], errors: Mapping[str, float]) -> bool:
    """Return whether the error bars of the increments reach a hundredth of a force or of the largest gauge strain.

    Parameters
    ----------
    numbers : numbers of a press by name, as `changing_numbers` returns them
    errors : error bars of the increments by name
    """
    return any(errors.get(name, 0.0) > TOLERANCE * scale for name, scale in scales(numbers).items())


@attempted
def more_increments(problem: Problem, last: StepResult, increments: int) -> ChangeEstimate:
    """Estimate what more increments would change in the last increment of a press in small strain."""
    check_kind(problem.model)
    if any(leg.steps == "auto" for leg in problem.model.legs):
        raise Finger3dError("the increments were chosen by their error")
    budget = CHANGES.seconds(problem.size.press_s(increments))
    if sum(_COUNTS) * increments * problem.size.contact_s > budget:
        raise Finger3dError(f"it would take more than {budget:.2g} s")
    values = changing_numbers(problem, last)
    some, many = (_numbers_in(problem, times) for times in _COUNTS)
    change = {name: 2.0 * many[name] - some[name] - x for name, x in values.items()}
    errors = {name: max(_SAFETY * abs(many[name] - some[name]), _LEAST_ERROR * abs(d)) for name, d in change.items()}
    by = " and ".join(str(times * increments) for times in _COUNTS)
    return ChangeEstimate(changes=judged(values, change, errors), method=f"presses in {by} increments, order 1")


def _numbers_in(problem: Problem, times: int) -> dict[str, float]:
    """Return the numbers in so many times the increments of the problem, all of which are given."""
    legs = tuple(replace(leg, steps=times * int(leg.steps)) for leg in problem.model.legs)
    many = replace(problem, model=replace(problem.model, legs=legs))
    return changing_numbers(many, last_step(many))
