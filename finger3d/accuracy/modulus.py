"""Error of the numbers of a press due to the spread of Young's modulus.

Stresses at given displacements are proportional to Young's modulus E of the finger, if nothing else in the model has a
modulus of its own.  On a path of given depths, forces, moments, energies and pressures hence have the relative error
of E, and lengths and strains have none.  Under a prescribed force F, a length or strain of the press depends on F / E
alone, and a force, energy or pressure on E and F / E ::

    J(F; (1 + s) E) = J(F / (1 + s); E),    J(F; (1 + s) E) = (1 + s) J(F / (1 + s); E)

which follow from the increments at smaller forces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from finger3d.mechanics.discretise.problem import Problem
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
) -> dict[str, float]:
    """Return the errors of the last increment due to the spread of Young's modulus, by name.

    Parameters
    ----------
    steps : all increments, converged
    spread : relative standard deviation of Young's modulus; None if it is given
    numbers : the numbers of an increment by name; of those that depend on the modulus, the errors are returned

    Returns
    -------
    dict
        In the units of the numbers.  Empty without a spread, where an elastic object, an embedded gauge or an elastic
        part has a modulus of its own, and under a prescribed force in several legs, with slides or with viscosity.
    """
    model = problem.model
    if not spread or not steps or not model.stresses_scale_with_modulus:
        return {}
    others = {column.key for column in steps[-1].readings if column.kind not in QUANTITIES}
    told = {name: x for name, x in numbers(problem, steps[-1]).items() if name not in others}
    if model.forces_scale_with_modulus:
        return {name: spread * abs(x) for name, x in told.items() if name.endswith(_STRESS_UNITS)}
    if not _is_press_to_force(model):
        return {}
    history = [numbers(problem, step) for step in steps]
    force = [0.0, *(entry["normal_force_N"] for entry in history)]
    out = {}
    for name, x in told.items():
        softer = float(np.interp(force[-1] / (1.0 + spread), force, [0.0, *(entry[name] for entry in history)]))
        stiff = (1.0 + spread) * softer if name.endswith(_STRESS_UNITS) else softer
        # the change by 1 / (1 + s) of the force, extrapolated to first order in s
        out[name] = (1.0 + spread) * abs(x - stiff)
    return {name: error for name, error in out.items() if error > _ROUND_OFF * abs(told[name])}


def _is_press_to_force(model: Model) -> bool:
    """Whether the path is a single leg straight down to a force, without viscosity."""
    if len(model.legs) != 1 or model.relaxation is not None:
        return False
    return model.legs[0].force_N is not None and not model.legs[0].moves_sideways
