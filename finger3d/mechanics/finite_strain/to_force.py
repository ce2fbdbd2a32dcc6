"""Iteration to a prescribed normal force at finite strain, with the depth as one more unknown.

In every iteration the object is moved further down by the distance delta at which the contact forces f of the
linearised body add up to the force F prescribed ::

    f = f(delta):  contact conditions of the gaps and slips at the depth d + delta,   sum of f_y over the points = F

The force at the end is F to round-off, and depth and displacements converge together, at about the cost of an increment
to a given depth.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from finger3d._types import Float
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.fem.tensors import InvertedError
from finger3d.mechanics.finite_strain.equations import converged
from finger3d.mechanics.finite_strain.increment import FiniteIncrement
from finger3d.mechanics.formulation import EndAtForce
from finger3d.objects import Move

_ITERATIONS, _FACTORS = 30, 8
"""Largest number of iterations and of factors, beyond which the depth is searched for."""

_SLOW = 0.35
"""Ratio of successive residuals above which the tangent is factored again."""

_ROOTS = 8
"""Largest number of contact solutions in an iteration."""

_INEXACT, _EXACT = 1e-2, 1e-10
"""Error of the force, over that at the start of the iteration and over the force, at which an iteration goes on."""


def end_at_force(increment: FiniteIncrement, wanted: float, guess: Float | None) -> EndAtForce | None:
    """Return the end of an increment at the depth with a prescribed normal force; None if no iteration gets there.

    Parameters
    ----------
    increment : to a depth where the iteration begins
    wanted : normal force on the whole finger, N
    guess : (c, d) contact forces where the iteration begins, N
    """
    now, force = increment.initial(guess)
    linearisation, factors, error, rate = increment.last_linearisation(), 0, math.inf, math.nan
    for _ in range(_ITERATIONS):
        if linearisation is None:
            if factors == _FACTORS:
                return None
            linearisation, factors = increment.linearise(now, force), factors + 1
        eliminated = linearisation.condensation.eliminated(-increment.out_of_balance(now, force))
        contact = partial(increment.contact, now, force, linearisation, eliminated.displacement)
        found = _balanced(increment, contact, now.contact.bases, wanted, rate)
        if found is None:
            return None
        lowered, rate, solution, change = found
        end = replace(increment.move.end, depth_mm=increment.move.end.depth_mm + lowered)
        increment = replace(increment, move=Move(increment.move.start, end))
        try:
            now = increment.moved(now, eliminated.unknowns(change))
        except InvertedError:
            return None
        force, last_error = solution.state.force, error
        error = increment.residual(now, solution.state, increment.out_of_balance(now, force))
        if converged(error, last_error):
            return EndAtForce(end.depth_mm, increment.reached(now, solution.state), rate)
        if error > _SLOW * last_error:
            linearisation = None
    return None


def _balanced(
    increment: FiniteIncrement,
    contact: Callable[[float], tuple[ContactSolution[ContactState], Float]],
    bases: Float,
    wanted: float,
    rate: float,
) -> tuple[float, float, ContactSolution[ContactState], Float] | None:
    """Return how much further down (mm) the linearised body has the force, by the secant method, and what is there.

    Parameters
    ----------
    contact : contact solution, and the changes of the forces, as a function of this distance
    rate : of the force, N/mm; NaN: taken from a force that is proportional to the depth

    Returns
    -------
    lowered, rate, solution, change; None without contact or a solution
    """
    lowered, last, goal = 0.0, (0.0, 0.0), _EXACT * wanted
    for number in range(_ROOTS):
        solution, change = contact(lowered)
        if not solution.outcome.ok or not np.isfinite(change).all():
            return None
        state = replace(solution.state, bases=bases)
        reached = -float(increment.problem.world_force(state)[:, 1].sum())
        if reached <= 0.0:
            return None
        if number:
            rate = (reached - last[1]) / (lowered - last[0])
        elif math.isnan(rate):
            rate = reached / increment.length_scale
        excess = reached - wanted
        goal = goal if number else max(goal, _INEXACT * abs(excess))
        if abs(excess) <= goal:
            return lowered, rate, solution, change
        if not rate > 0.0:
            return None
        last, lowered = (lowered, reached), lowered - excess / rate
    return None
