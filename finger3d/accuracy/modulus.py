"""Error of the numbers of a press due to the spread of Young's modulus.

Stresses at given displacements are proportional to Young's modulus E of the finger, if nothing else in the model has a
modulus of its own.  On a path of given depths, forces, moments, energies and pressures hence have the relative error
of E, and lengths and strains have none.  Under a prescribed force F, a length or strain of the press depends on F / E
alone, and a force, energy or pressure on E and F / E ::

    J(F; (1 + s) E) = J(F / (1 + s); E),    J(F; (1 + s) E) = (1 + s) J(F / (1 + s); E)

On a single leg straight down this follows from the increments at smaller forces, on other paths in small strain from a
press with all forces divided by 1 + s, which has the same condensation.  In all other models, and for the modulus of a
part, the scene is pressed twice on a coarser mesh, with E times r = 1 + s and divided by it ::

    error of J = s |J(r E) - J(E / r)| / (2 log r)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from finger3d._cost import CHANGES
from finger3d.accuracy.cost import forecast, without_output_s
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Material
from finger3d.mechanics.discretise.companions import built_like, coarser
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.march.path import stations
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import last_step, with_increments_of
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.readings.columns import QUANTITIES
from finger3d.mechanics.results.history import StepResult

Measure = Callable[[Problem, StepResult], dict[str, float]]

_STRESS_UNITS = ("_N", "_Nmm", "_mJ", "_MPa")
"""Ends of the names of numbers that are proportional to the stresses."""

_ROUND_OFF = 1e-9
"""Relative error of a number that does not depend on the modulus, such as the prescribed force."""

_FACTORS = (2.0, 2.83, 4.0)
"""Edge lengths of a coarse mesh over those of the press; the first that is cheap enough is taken."""

_MOST_STEPS = 5
"""Largest number of increments in a leg on the coarser mesh."""


def modulus_errors(
    problem: Problem,
    steps: Sequence[StepResult],
    spreads: Mapping[str, float],
    numbers: Measure,
    workspace: Workspace | None = None,
) -> tuple[dict[str, float], str]:
    """Return the errors of the last increment due to the spreads of Young's moduli of the finger, by name.

    Those of several moduli, which are independent, add as squares.

    Parameters
    ----------
    steps : all increments, converged
    spreads : relative standard deviation of Young's modulus by the label of the part, that of the main body by ""
    numbers : the numbers of an increment by name; of those that depend on the moduli, the errors are returned
    workspace : of the press

    Returns
    -------
    errors : in the units of the numbers; empty without a spread or an estimate
    reason : why there is no estimate, in words; empty if there is one, or nothing to estimate
    """
    if not spreads or not steps:
        return {}, ""
    try:
        found = [_of_part(problem, steps, part, numbers, workspace) for part in spreads.items()]
    except (Finger3dError, RuntimeError, ValueError, np.linalg.LinAlgError, MemoryError) as error:
        return {}, str(error) or type(error).__name__
    names = dict.fromkeys(name for errors in found for name in errors)
    return {name: math.hypot(*(errors.get(name, 0.0) for errors in found)) for name in names}, ""


def _of_part(
    problem: Problem,
    steps: Sequence[StepResult],
    part: tuple[str, float],
    numbers: Measure,
    workspace: Workspace | None,
) -> dict[str, float]:
    """Return the errors due to the spread of one modulus, by name; `part` is its label and this spread."""
    label, spread = part
    others = {column.key for column in steps[-1].readings if column.kind not in QUANTITIES}
    told = {name: x for name, x in numbers(problem, steps[-1]).items() if name not in others}
    model = problem.model
    if not label and model.forces_scale_with_modulus:
        return {name: spread * abs(x) for name, x in told.items() if name.endswith(_STRESS_UNITS)}
    ratio = 1.0 + spread
    scales = not label and model.stresses_scale_with_modulus
    if not scales or (model.finite_strain and not _is_press_to_force(model)):
        soft, stiff = (_on_coarser_mesh(problem, len(steps), (label, e), numbers) for e in (1.0 / ratio, ratio))
        share = 0.5 * spread / math.log(ratio)
    else:
        soft, share = told, ratio
        stiff = _stiffer_by_scaling(problem, steps, ratio, numbers, workspace)
    errors = {name: share * abs(stiff[name] - soft[name]) for name in told}
    return {name: error for name, error in errors.items() if error > _ROUND_OFF * abs(told[name])}


def _stiffer_by_scaling(
    problem: Problem,
    steps: Sequence[StepResult],
    ratio: float,
    numbers: Measure,
    workspace: Workspace | None,
) -> dict[str, float]:
    """Return the numbers, by name, with Young's modulus times a ratio, from a press to forces divided by it."""
    if _is_press_to_force(problem.model):
        history = [numbers(problem, step) for step in steps]
        force = [0.0, *(entry["normal_force_N"] for entry in history)]
        softer = {
            name: float(np.interp(force[-1] / ratio, force, [0.0, *(entry[name] for entry in history)]))
            for name in history[-1]
        }
    else:
        softer = numbers(problem, _last_of_press_to_less(problem, len(steps), ratio, workspace))
    return {name: (ratio if name.endswith(_STRESS_UNITS) else 1.0) * x for name, x in softer.items()}


def _on_coarser_mesh(problem: Problem, increments: int, part: tuple[str, float], numbers: Measure) -> dict[str, float]:
    """Return the numbers, by name, on a coarser mesh, with Young's modulus of one part times a ratio.

    `part` is its label, empty for the main body, and the ratio.
    """
    model, (label, ratio) = problem.model, part
    legs = _finished_legs(model, increments)
    few = tuple(replace(leg, steps=min(int(leg.steps), _MOST_STEPS)) for leg in legs)
    changed = replace(
        model,
        material=_times(model.material, 1.0 if label else ratio),
        parts=tuple((name, _times(one, ratio if name == label else 1.0)) for name, one in model.parts),
        legs=few,
    )
    seconds = CHANGES.seconds(forecast(replace(model, legs=legs))["total_s"])
    factor = _affordable_factor(lambda factor: coarser(changed, factor), seconds)
    beside = built_like(problem, coarser(changed, factor))
    return numbers(beside, last_step(beside))


def _affordable_factor(coarse: Callable[[float], Model], budget_s: float) -> float:
    """Return the edge lengths of a coarse mesh over those of the press, whose modelled cost is within a budget."""
    for factor in _FACTORS:
        if without_output_s(forecast(coarse(factor))) <= budget_s:
            return factor
    raise Finger3dError(f"it would take more than {budget_s:.2g} s")


def _times(material: Material, ratio: float) -> Material:
    """Return a material with its Young's modulus times a ratio."""
    own = material.isotropic("the spread of E_MPa")
    return replace(own, E_MPa=ratio * own.E_MPa)


def _last_of_press_to_less(problem: Problem, increments: int, ratio: float, workspace: Workspace | None) -> StepResult:
    """Return the last increment of a press to forces divided by a ratio.

    Raises
    ------
    Finger3dError
        If it, or the press, did not reach the end of the path.
    """
    legs = tuple(
        leg if leg.force_N is None else replace(leg, force_N=leg.force_N / ratio)
        for leg in _finished_legs(problem.model, increments)
    )
    *_, last = march(replace(problem, model=replace(problem.model, legs=legs)), workspace=workspace)
    last.check("the press to smaller forces")
    return last


def _finished_legs(model: Model, increments: int) -> tuple[Leg, ...]:
    """Return the legs with the increments of the press, which reached their end."""
    legs = with_increments_of(model.legs, increments)
    if len(stations(legs)) != increments:
        raise Finger3dError("the press did not reach the end of the path")
    return legs


def _is_press_to_force(model: Model) -> bool:
    """Whether the path is a single leg straight down to a force, without viscosity."""
    if len(model.legs) != 1 or model.relaxation is not None:
        return False
    return model.legs[0].force_N is not None and not model.legs[0].moves_sideways
