"""Error of the numbers of a press due to the spread of Young's modulus.

Stresses at given displacements are proportional to Young's modulus E of the finger, if nothing else in the model has a
modulus of its own.  On a path of given depths, forces, moments, energies and pressures hence have the relative error
of E, and lengths and strains have none.  Under a prescribed force F, a length or strain of the press depends on F / E
alone, and a force, energy or pressure on E and F / E ::

    J(F; (1 + s) E) = J(F / (1 + s); E),    J(F; (1 + s) E) = (1 + s) J(F / (1 + s); E)

On a single leg straight down this follows from the increments at smaller forces, on other paths in small strain from a
press with all forces divided by 1 + s, which has the same condensation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.march.path import stations
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import with_increments_of
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.columns import QUANTITIES
from finger3d.mechanics.results.history import StepResult

_STRESS_UNITS = ("_N", "_Nmm", "_mJ", "_MPa")
"""Ends of the names of numbers that are proportional to the stresses."""

_ROUND_OFF = 1e-9
"""Relative error of a number that does not depend on the modulus, such as the prescribed force."""


def modulus_errors(
    problem: Problem,
    steps: Sequence[StepResult],
    spread: float | None,
    numbers: Callable[[Problem, StepResult], dict[str, float]],
    workspace: Workspace | None = None,
) -> dict[str, float]:
    """Return the errors of the last increment due to the spread of Young's modulus, by name.

    Parameters
    ----------
    steps : all increments, converged
    spread : relative standard deviation of Young's modulus; None if it is given
    numbers : the numbers of an increment by name; of those that depend on the modulus, the errors are returned
    workspace : of the press

    Returns
    -------
    dict
        In the units of the numbers.  Empty without a spread, and where `why_unknown` says why.
    """
    model = problem.model
    if not spread or not steps or not model.stresses_scale_with_modulus:
        return {}
    others = {column.key for column in steps[-1].readings if column.kind not in QUANTITIES}
    told = {name: x for name, x in numbers(problem, steps[-1]).items() if name not in others}
    if model.forces_scale_with_modulus:
        return {name: spread * abs(x) for name, x in told.items() if name.endswith(_STRESS_UNITS)}
    ratio = 1.0 + spread
    if _is_press_to_force(model):
        history = [numbers(problem, step) for step in steps]
        force = [0.0, *(entry["normal_force_N"] for entry in history)]
        softer = {
            name: float(np.interp(force[-1] / ratio, force, [0.0, *(entry[name] for entry in history)]))
            for name in told
        }
    elif model.finite_strain or (last := _last_of_press_to_less(problem, len(steps), ratio, workspace)) is None:
        return {}
    else:
        softer = numbers(problem, last)
    # the change by 1 / (1 + s) of the force, extrapolated to first order in s
    stiff = {name: (ratio if name.endswith(_STRESS_UNITS) else 1.0) * softer[name] for name in told}
    errors = {name: ratio * abs(x - stiff[name]) for name, x in told.items()}
    return {name: error for name, error in errors.items() if error > _ROUND_OFF * abs(told[name])}


def why_unknown(model: Model) -> str:
    """Return why the errors due to the spread of Young's modulus are not known, in words; empty if they may be."""
    if not model.stresses_scale_with_modulus:
        return "parts, foils or the object have a modulus of their own"
    if model.finite_strain and not model.forces_scale_with_modulus and not _is_press_to_force(model):
        return "at large deformation, under a force in several legs or with viscosity, they take another press"
    return ""


def _last_of_press_to_less(
    problem: Problem, increments: int, ratio: float, workspace: Workspace | None
) -> StepResult | None:
    """Return the last increment of a press to forces divided by a ratio; None if it, or the press, did not converge."""
    legs = tuple(
        leg if leg.force_N is None else replace(leg, force_N=leg.force_N / ratio)
        for leg in with_increments_of(problem.model.legs, increments)
    )
    if len(stations(legs)) != increments:
        return None
    *_, last = march(replace(problem, model=replace(problem.model, legs=legs)), workspace=workspace)
    return last if last.outcome.ok else None


def _is_press_to_force(model: Model) -> bool:
    """Whether the path is a single leg straight down to a force, without viscosity."""
    if len(model.legs) != 1 or model.relaxation is not None:
        return False
    return model.legs[0].force_N is not None and not model.legs[0].moves_sideways
