"""Error estimate of a press: the discretisation error, and the error due to the size of the increments.

The discretisation error follows from the same press on companion meshes (`finger3d.mechanics.discretise.companions`,
`finger3d.accuracy.richardson`).

Which counts of increments are solved, and on which mesh, follows from the numbers of increments, unknowns and contact
points.  Two identical presses hence have identical error bars, whatever the load of the machine.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from finger3d._cost import INCREMENT_ERRORS_S, INCREMENT_ERRORS_SHARE
from finger3d.accuracy.companion_presses import CompanionPress, companion_presses
from finger3d.accuracy.error_bars import ErrorBars
from finger3d.accuracy.richardson import spacing, spread_error
from finger3d.errors import FAILURES, Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.step_halving import (
    StepEstimate,
    errors_of_runs,
    last_step,
    step_error,
    with_increments_of,
)
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.postprocess.marker_grid import MarkerGrid
from finger3d.mechanics.readings import AREAS, GIVEN_BY_FORCE, MAIN, RESULTANTS, SLIP, by_key, in_space
from finger3d.meshing.given.given import GivenMesh
from finger3d.progress import QUIET, Progress

Measure = Callable[[Problem, StepResult], dict[str, float]]

Companions = Callable[[Problem, StepEstimate | None, Progress], list[CompanionPress]]
"""Returns the presses of companions, as `companion_presses` does."""


@dataclass(frozen=True, kw_only=True)
class ErrorEstimate(ErrorBars):
    """Error bars of the last increment, and the companion they come from.

    Attributes
    ----------
    companion_numbers : numbers of the companion by name; empty without a companion mesh
    ratio : edge length of the companion over that of the mesh; below 1 for a finer companion
    """

    companion_numbers: dict[str, float] = field(default_factory=dict)
    ratio: float = math.nan


def main_numbers(problem: Problem, step: StepResult) -> dict[str, float]:
    """Return forces, lengths and areas of contact and stick, what is left until slip, and readings, by name."""
    numbers = measure(problem.points, step)
    return {name: numbers[name] for name in (*MAIN, *AREAS, *SLIP)} | by_key(step.readings)


def press_numbers(problem: Problem, step: StepResult) -> dict[str, float]:
    """Return the numbers of a press that have an error bar: the main numbers, resultants and both energies.

    Under a prescribed force the depth is one of them.
    """
    measured = measure(problem.points, step)
    others = (*RESULTANTS[problem.dim], "external_work_mJ", "dissipation_mJ", "contact_half_length_end_mm")
    numbers = main_numbers(problem, step) | {name: float(measured[name]) for name in others if name in measured}
    return {"depth_mm": step.target.depth_mm, **numbers} if problem.model.ends_at_force else numbers


def estimate(
    problem: Problem,
    steps: Sequence[StepResult],
    report: Progress = QUIET,
    numbers: Measure = main_numbers,
    chosen: StepEstimate | None = None,
    companions: Companions = companion_presses,
) -> ErrorEstimate:
    """Estimate the errors of the last increment from the mesh and from other counts of increments.

    Parameters
    ----------
    problem, steps : the press as it was solved, all increments converged
    report : receives the messages
    numbers : the numbers of an increment by name, of the kinds in `finger3d.accuracy.richardson.kinds_of`
    chosen : how automatic increments were chosen
    companions : presses the companions, or returns what was pressed already

    Returns
    -------
    ErrorEstimate
        If the part of the mesh or that of the increments fails, the other stays as it is, and `method` has the reason.
    """
    start = time.perf_counter()
    if not steps or not steps[-1].outcome.ok:
        return ErrorEstimate(method="no estimate: the last increment did not converge")
    automatic = chosen is not None and all(leg.steps == "auto" for leg in problem.model.legs)
    used = chosen if automatic else None
    # from here on, automatic increments are numbers
    own = replace(problem, model=replace(problem.model, legs=with_increments_of(problem.model.legs, len(steps))))
    beside, where = None, ""
    try:
        found, beside, where = discretisation(own, steps, report, numbers, used, companions)
    except FAILURES as error:
        found = ErrorEstimate(method=f"mesh: no estimate: {_reason(error)}")
    try:
        known = found.companion_numbers
        increment_errors, by = _of_increments(own, steps, (beside, where, known), numbers, used)
    except FAILURES as error:
        increment_errors, by = {}, f"no estimate: {_reason(error)}"
    if own.model.ends_at_force:  # the normal force is given
        mesh = {name: error for name, error in found.discretisation.items() if name not in GIVEN_BY_FORCE}
        found = replace(found, discretisation=mesh)
        increment_errors = {name: error for name, error in increment_errors.items() if name not in GIVEN_BY_FORCE}
    method, seconds = f"{found.method}; steps: {by}", time.perf_counter() - start
    return replace(found, steps=increment_errors, method=method, seconds=seconds)


def estimate_with_grid(
    problem: Problem,
    steps: Sequence[StepResult],
    grid: MarkerGrid,
    report: Progress = QUIET,
    chosen: StepEstimate | None = None,
    companions: Companions = companion_presses,
) -> tuple[ErrorEstimate, dict[str, float]]:
    """Estimate the errors of a press, and those of the displacements of a grid of markers.

    Returns
    -------
    press : the errors of `press_numbers`, as `estimate` returns them
    markers : sums of the errors of mesh and increments by the keys of the columns, mm; empty without an estimate
    """

    def moved(p: Problem, step: StepResult) -> dict[str, float]:
        return by_key(MarkerGrid.at(p, grid.markers).readings(p, step))

    def both(p: Problem, step: StepResult) -> dict[str, float]:
        return press_numbers(p, step) | moved(p, step)

    if not steps or not steps[-1].outcome.ok:
        return estimate(problem, steps, report, press_numbers, chosen, companions), {}
    own = grid.readings(problem, steps[-1])
    read = [*steps[:-1], replace(steps[-1], readings=steps[-1].readings | own)]
    found = estimate(problem, read, report, both, chosen, companions)
    totals, of_grid = found.totals(), by_key(own)

    def of_press(errors: Mapping[str, float]) -> dict[str, float]:
        return {name: error for name, error in errors.items() if name not in of_grid}

    mesh, increments, beside = map(of_press, (found.discretisation, found.steps, found.companion_numbers))
    found = replace(found, discretisation=mesh, steps=increments, companion_numbers=beside)
    return found, {name: error for name, error in totals.items() if name in of_grid}


def _of_increments(
    own: Problem,
    steps: Sequence[StepResult],
    mesh: tuple[Problem | None, str, Mapping[str, float]],
    numbers: Measure,
    chosen: StepEstimate | None,
) -> tuple[dict[str, float], str]:
    """Return the errors due to the increments by name, and how they were estimated.

    Parameters
    ----------
    mesh : a press that costs less, or None, what it differs in, in words, and its numbers if they are known
    chosen : runs that chose automatic increments
    """
    if chosen:
        runs = [(count, numbers(chosen.beside or own, results[-1])) for count, results in chosen.runs]
        *fewer, most = (str(count) for count, _ in runs)
        on = " on a coarser mesh" if chosen.beside else ""
        return errors_of_runs(runs), f"{', '.join(fewer)} and {most}{on}, order 1"
    beside, where, known = mesh
    beside_s = math.inf if beside is None else _marching_cost(beside)
    failure: Exception | None = None
    own_s = _marching_cost(own)
    budget = max(INCREMENT_ERRORS_S, INCREMENT_ERRORS_SHARE * (own.size.condensation_s + own_s))
    trials = [(own, 2.0, own_s), (beside, 2.0, beside_s), (beside, 0.5, 0.0), (own, 0.5, 0.0)]
    for judged, ratio, seconds in trials:
        if judged is None or ratio * seconds > budget:
            continue
        try:
            there = numbers(own, steps[-1]) if judged is own else known or numbers(judged, last_step(judged))
            errors = step_error(judged, there, numbers, ratio)
        except FAILURES as error:
            failure = failure or error
            continue
        by = "twice" if ratio > 1.0 else "half"
        return errors, f"{by} as many{'' if judged is own else ' ' + where}, order 1"
    raise failure or Finger3dError("no run with another number of increments")


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


def discretisation(
    own: Problem,
    steps: Sequence[StepResult],
    report: Progress = QUIET,
    numbers: Measure = main_numbers,
    chosen: StepEstimate | None = None,
    companions: Companions = companion_presses,
) -> tuple[ErrorEstimate, Problem, str]:
    """Estimate the discretisation errors of the last increment.

    Returns
    -------
    estimate : without errors of the increments
    beside : a press that costs less than this one
    where : what that press differs in, in words
    """
    pressed = companions(own, chosen, report)
    told = [(one.ratio, numbers(one.problem, one.end)) for one in pressed]
    ratio, beside, _ = pressed[0]
    kind = "coarse" if ratio > 1.0 else "finer"
    found = ErrorEstimate(
        discretisation=spread_error(
            numbers(own, steps[-1]), told, in_space(steps[-1].readings), spacing(own, steps[-1])
        ),
        method=_on_meshes([one.problem for one in pressed], kind),
        companion_numbers=told[0][1],
        ratio=ratio,
    )
    return found, beside, f"on the {kind} mesh"


def _marching_cost(problem: Problem) -> float:
    """Return the modelled seconds of all increments, from their number, the contact points and the unknowns."""
    model, size = problem.model, problem.size
    count = sum(leg.steps if isinstance(leg.steps, int) else AUTO_START for leg in model.legs)
    if model.finite_strain:
        return count * (size.contact_s + size.finite_strain_s)
    return count * size.contact_s + len(model.legs) * size.condensation_s * model.refactorises


def _on_meshes(companions: Sequence[Problem], kind: str) -> str:
    """Return how the discretisation error was estimated."""
    own = companions[0].model
    given = isinstance(own.design, GivenMesh)
    mesher = "bisected" if given else own.mesh.mesher if companions[0].dim == 3 else "structured"
    sizes = f"{mesher}, {', '.join(f'{beside.model.mesh.size_mm:.4g}' for beside in companions)} mm"
    sizes += ", of both bodies" if own.object_compliance else ""
    dofs = ", ".join(str(beside.size.dofs) for beside in companions)
    return f"mesh: {dofs} dofs ({sizes}) beside, {'finer, ' * (kind == 'finer')}spread"
