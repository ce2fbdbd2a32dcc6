"""Error of the numbers of a press due to the spread of Young's modulus.

Where all forces are proportional to the modulus, forces, moments, energies and pressures have its relative error, and
lengths and strains have none.  Elsewhere the scene is pressed on a coarser mesh with the modulus of each part less and
plus its spread.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from finger3d.accuracy.estimate import Measure
from finger3d.errors import FAILURES, MissingError
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.companions import companion
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.step_halving import with_increments_of
from finger3d.mechanics.march.variants import press_variants
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import MEASURED, quantities

_ROUND_OFF = 1e-9
"""Relative error of a number that does not depend on the modulus, such as the prescribed force."""


def modulus_errors(
    problem: Problem, steps: Sequence[StepResult], spreads: Mapping[str, float], numbers: Measure
) -> tuple[dict[str, float], str]:
    """Return the errors of the last increment due to the spreads of Young's moduli of the finger, by name.

    Those of several moduli, which are independent, add as squares.

    Parameters
    ----------
    steps : all increments, converged
    spreads : relative standard deviation of Young's modulus by the label of the part, that of the main body by ""
    numbers : the numbers of an increment by name; of those that depend on the moduli, the errors are returned

    Returns
    -------
    errors : in the units of the numbers; empty without a spread or an estimate
    reason : why there is no estimate, in words; empty if there is one, or nothing to estimate
    """
    if not spreads or not steps:
        return {}, ""
    others = {column.key for column in steps[-1].readings if column.kind not in MEASURED}
    told = {name: x for name, x in numbers(problem, steps[-1]).items() if name not in others}
    if set(spreads) == {""} and problem.model.forces_scale_with_modulus:
        known = quantities(steps[-1].readings)
        return {name: spreads[""] * abs(x) for name, x in told.items() if known[name].is_stress}, ""
    try:
        found = _by_variants(problem, len(steps), spreads, numbers)
    except FAILURES as error:
        return {}, str(error) or type(error).__name__
    errors = {name: math.hypot(*(one.get(name, 0.0) for one in found)) for name in told}
    return {name: error for name, error in errors.items() if error > _ROUND_OFF * abs(told[name])}, ""


def _by_variants(
    problem: Problem, increments: int, spreads: Mapping[str, float], numbers: Measure
) -> list[dict[str, float]]:
    """Return the errors by name due to each spread, from presses on a coarser mesh."""
    legs = with_increments_of(problem.model.legs, increments)
    beside = companion(replace(problem, model=replace(problem.model, legs=legs)))
    models = [times_modulus(beside.model, 1.0 + sign * s, label) for label, s in spreads.items() for sign in (-1, 1)]
    ends = press_variants(beside, models, lambda p, steps: numbers(p, steps[-1]))
    found = []
    for soft, stiff in zip(ends[::2], ends[1::2], strict=True):
        if soft.found is None or stiff.found is None:
            raise MissingError(soft.failure or stiff.failure)
        found.append({name: 0.5 * abs(x - soft.found[name]) for name, x in stiff.found.items()})
    return found


def times_modulus(model: Model, ratio: float, label: str | None = None) -> Model:
    """Return a model with Young's modulus of one part, "" for the main body, or of all of them times a ratio."""

    def scaled(name: str, material: Isotropic) -> Isotropic:
        return replace(material, E_MPa=(ratio if label in (None, name) else 1.0) * material.E_MPa)

    parts = tuple((name, scaled(name, one)) for name, one in model.parts)
    return replace(model, material=scaled("", model.material), parts=parts)
