"""Errors of a press, estimated: those of the mesh and of the increments, and that of the spread of Young's modulus.

The discretisation error follows from the same press on companion meshes (`finger3d.mechanics.discretise.companions`,
`finger3d.accuracy.error_bars`).

Which counts of increments are solved, and on which mesh, follows from the numbers of increments, unknowns and contact
points.  Two identical presses hence have identical error bars, whatever the load of the machine.

Where all forces are proportional to the modulus, forces, moments, energies and pressures have its relative error, and
lengths and strains have none.  Elsewhere the scene is pressed on a coarser mesh with the modulus of each part less and
plus its spread.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from threading import Event
from types import TracebackType
from typing import NamedTuple, Self

from finger3d._cost import INCREMENT_ERRORS_S, INCREMENT_ERRORS_SHARE
from finger3d.accuracy.error_bars import ErrorBars, spacing, spread, spread_error
from finger3d.contact.acceleration import one_thread
from finger3d.errors import FAILURES, Finger3dError, MissingError
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.companions import coarse_companions, companion, finer_companions
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import SlipEvent, StepResult, measure, slip_margin, slips
from finger3d.mechanics.march.step_halving import (
    StepEstimate,
    all_steps,
    errors_of_runs,
    rough_steps,
    step_error,
    with_increments_of,
)
from finger3d.mechanics.march.variants import press_variants
from finger3d.mechanics.model import Model
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.postprocess.marker_grid import MarkerGrid
from finger3d.mechanics.readings import (
    AREAS,
    GIVEN_BY_FORCE,
    MAIN,
    MEASURED,
    RESULTANTS,
    SLIP,
    Kind,
    by_key,
    in_space,
    quantities,
)
from finger3d.meshing.given import GivenMesh
from finger3d.progress import QUIET, Progress


class CompanionPress(NamedTuple):
    """Edge length of a companion over that of the mesh, its problem, and its increments."""

    ratio: float
    problem: Problem
    steps: Sequence[StepResult]


def companion_presses(
    problem: Problem,
    chosen: StepEstimate | None = None,
    report: Progress = QUIET,
    cancel: Event | None = None,
    unknowns: int | None = None,
) -> list[CompanionPress]:
    """Press the companions of a problem in the same increments, which are numbers; those that fail are left out.

    They have coarser meshes; where there are none, finer ones.

    Parameters
    ----------
    chosen : runs of a companion that chose automatic increments
    unknowns : of the mesh whose error follows, in place of those of the problem's
    """
    found = []
    for ratio, beside in coarse_companions(problem, report, chosen.beside if chosen else None, unknowns):
        try:
            found.append(CompanionPress(ratio, beside, _pressed(beside, chosen, cancel)))
        except FAILURES:
            continue
    if not found:
        finer = finer_companions(problem, report)
        found = [CompanionPress(ratio, beside, _pressed(beside, None, cancel)) for ratio, beside in finer]
    return found


def _pressed(beside: Problem, chosen: StepEstimate | None, cancel: Event | None) -> Sequence[StepResult]:
    """Return the increments of a companion, pressed roughly unless they are known."""
    if chosen and chosen.beside and chosen.beside.mesh is beside.mesh:
        count, steps = chosen.runs[-1]
        if all(leg.steps == count for leg in beside.model.legs):
            return steps
    return rough_steps(beside, cancel)


class CompanionThread:
    """Thread in which the companions of one problem are pressed while that is pressed itself.

    An increment at finite strain has too little work for two threads; two presses do not take much longer than one.
    """

    def __init__(self) -> None:
        self._problem: Problem | None = None
        self._cancel, self._running = Event(), ExitStack()
        self._future: Future[list[CompanionPress]] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._cancel.set()
        self._running.close()

    def begin(self, problem: Problem, chosen: StepEstimate | None = None) -> None:
        """Press the companions of a problem in increments that are numbers; those of an earlier one are given up."""
        self.__exit__(None, None, None)
        self._problem, self._cancel = problem, Event()
        self._running.enter_context(one_thread())
        pool = self._running.enter_context(ThreadPoolExecutor(1))
        self._future = pool.submit(companion_presses, problem, chosen, QUIET, self._cancel)

    def of(self, problem: Problem, chosen: StepEstimate | None, report: Progress) -> list[CompanionPress]:
        """Return the presses of a problem's companions, made now unless they were begun; raises what they raised."""
        if self._future is None or self._problem is None or self._problem.mesh is not problem.mesh:
            return companion_presses(problem, chosen, report)
        try:
            return self._future.result()
        finally:
            self._running.close()


_WITHIN_INCREMENT = 0.5
"""Error of the place of an event within its increment, in increments."""

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
    slip : errors of the events of `finger3d.mechanics.history.slips`, in increments
    """

    companion_numbers: dict[str, float] = field(default_factory=dict)
    ratio: float = math.nan
    slip: dict[str, float] = field(default_factory=dict)


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
    numbers : the numbers of an increment by name, of the kinds in `finger3d.accuracy.error_bars.kinds_of`
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
    grid: MarkerGrid | None,
    report: Progress = QUIET,
    chosen: StepEstimate | None = None,
    companions: Companions = companion_presses,
) -> tuple[ErrorEstimate, dict[str, float]]:
    """Estimate the errors of a press, and those of the displacements of a grid of markers, if there is one.

    Returns
    -------
    press : the errors of `press_numbers`, as `estimate` returns them
    markers : sums of the errors of mesh and increments by the keys of the columns, mm; empty without an estimate
    """

    if grid is None or not steps or not steps[-1].outcome.ok:
        return estimate(problem, steps, report, press_numbers, chosen, companions), {}
    own, markers = grid.readings(problem, steps[-1]), grid.markers
    read, of_grid = [*steps[:-1], replace(steps[-1], readings=steps[-1].readings | own)], by_key(own)

    def both(p: Problem, step: StepResult) -> dict[str, float]:
        return press_numbers(p, step) | by_key(MarkerGrid.at(p, markers).readings(p, step))

    def of_press(errors: Mapping[str, float]) -> dict[str, float]:
        return {name: error for name, error in errors.items() if name not in of_grid}

    found = estimate(problem, read, report, both, chosen, companions)
    errors = {name: error for name, error in found.totals().items() if name in of_grid}
    return replace(found, discretisation=of_press(found.discretisation), steps=of_press(found.steps)), errors


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
            there = numbers(own, steps[-1]) if judged is own else known or numbers(judged, all_steps(judged)[-1])
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
    told = [(one.ratio, numbers(one.problem, one.steps[-1])) for one in pressed]
    ratio, beside, _ = pressed[0]
    kind = "coarse" if ratio > 1.0 else "finer"
    end = steps[-1]
    found = ErrorEstimate(
        discretisation=spread_error(numbers(own, end), told, in_space(end.readings), spacing(own, end)),
        method=_on_meshes([one.problem for one in pressed], kind),
        companion_numbers=told[0][1],
        ratio=ratio,
        slip=_errors_of_slip(own, steps, pressed),
    )
    return found, beside, f"on the {kind} mesh"


def _errors_of_slip(own: Problem, steps: Sequence[StepResult], pressed: Sequence[CompanionPress]) -> dict[str, float]:
    """Return the errors, in increments, of slip events that all companions have, half an increment at least."""

    def events(points: ContactPoints, steps: Sequence[StepResult]) -> dict[str, SlipEvent | None]:
        margin = [slip_margin(points, step.state, step.friction) for step in steps]
        return slips(points, steps, margin, own.model.readings)

    others, found = [(one.ratio, events(one.problem.points, one.steps)) for one in pressed], {}
    for name, event in events(own.points, steps).items():
        told = [(ratio, there.increments) for ratio, one in others if (there := one.get(name))]
        if event and len(told) == len(others):
            found[name] = _WITHIN_INCREMENT + spread(Kind.FRICTION_SUM, event.increments, told)
    return found


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
