"""The smallest grip force at which two fingers hold an object."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import with_few_increments
from finger3d.progress import Progress

_WITHIN = 0.01
"""Relative distance of a force that holds and one that does not at which the search ends."""

_INCREMENTS = 5
"""Increments of closing and of each load: the force at which all of a contact slips hardly depends on them."""

_NONE = 1e-4
"""Share of the largest force below which no grip is needed."""


def least_grip(problem: Problem, largest: float, report: Progress) -> float:
    """Return the smallest force (N) that holds the object, within 1 % of one that does not, or 0 if none is needed.

    The first two trials are next to the force at which Coulomb's friction on flat faces bears the load.

    Parameters
    ----------
    problem : a finger of a grip
    largest : force (N) of each finger that holds
    """
    few = with_few_increments(problem, _INCREMENTS)
    workspace = formulation_of(problem.model).workspace()

    def holds(force: float) -> bool:
        legs = tuple(replace(leg, force_N=2.0 * force) for leg in few.model.legs)
        steps = list(march(replace(few, model=replace(few.model, legs=legs)), workspace=workspace))
        report.say(f"a grip of {force:.4g} N {'holds' if steps[-1].outcome.ok else 'does not hold'} the object")
        return steps[-1].outcome.ok

    mu = problem.model.friction.largest
    tangential = max(math.hypot(leg.force_x_N or 0.0, leg.force_z_N or 0.0) for leg in few.model.legs)
    flat = 0.5 * tangential / mu if mu > 0.0 else math.inf
    trials = [share * flat for share in (1.0 + 0.45 * _WITHIN, 1.0 - 0.45 * _WITHIN)]
    not_held, held = 0.0, largest
    while held > max((1.0 + _WITHIN) * not_held, _NONE * largest):
        known = [trial for trial in trials if not_held < trial < held]
        force = known[0] if known else float(np.sqrt(not_held * held)) if not_held else 0.5 * held
        not_held, held = (not_held, force) if holds(force) else (force, held)
    return held if not_held else 0.0
