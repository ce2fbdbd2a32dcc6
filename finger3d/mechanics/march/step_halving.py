"""Number of increments, chosen by the estimated error of the result.

The path is solved in N, 2 N, 4 N, ... increments.  The error of a quantity x(N) is of second order on the whole, but
points close one by one, so that it falls unevenly.  Two runs are compared as if it were of first order, with which four
of five errors that count are within twice their estimate (second order: two of five)::

    error of x(2 N) = |x(2 N) - x(N)|

Two runs may agree by chance.  Three are therefore compared where they cost little, and an earlier pair of runs counts
as if its error fell with the power 3/2 of the number of increments.  ``validation/error_bars.py`` measures how often
the true error is within twice this estimate.

At large deformation every increment factorises the tangent.  There the runs are those of a coarser mesh, on which
increments leave the same errors (those of force, friction and strain within a third on meshes with twice and four times
the edges), and the press itself is solved once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from threading import Event
from typing import TypeAlias, TypeVar

from finger3d._cost import AUTOMATIC_S, PressSize
from finger3d._types import Float
from finger3d.contact.solve import STEP_DEPENDENT_RULES
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.companions import coarse_companions
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.solve import CUTS, march
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import AUTO_START, stations
from finger3d.mechanics.readings import by_key, of_kind

Measurement = Callable[[Problem, StepResult], dict[str, float]]
"""Quantities by name, measured at the end of a press."""

Value = TypeVar("Value", float, Float)

Run: TypeAlias = tuple[int, tuple[StepResult, ...]]
"""Number of increments in an automatic leg, and the results of all increments."""

TOLERANCE = 0.01
"""Relative error allowed in normal force, friction sum and strain, on the scales of `StepEstimate`."""

DISSIPATION_TOLERANCE = 0.05
"""Relative error allowed in the dissipation, or in a fiftieth of the external work if that is larger."""

_LEAST_DISSIPATION = 0.02
"""Share of the external work in which the error of a smaller dissipation is measured."""

_LEAST_STRAIN = 0.05
"""Share of the depth over the height in which the error of a smaller strain is measured, as where a gauge reads 0."""

_FIRST, _LARGEST = 5, 640

_LEAST_RUNS = 3
"""Runs of which two may agree by chance."""

_FALL = 1.5
"""Power of the number of increments with which an error falls, between that of kinks, 1, and of smooth paths, 2."""

_FEW = 10
"""Largest number of increments in a leg of a press for the errors of the mesh, which hardly depend on this number."""

FEW_CUTS = 1
"""Times that an increment of a press which serves an estimate is halved, at most: it may cost more than the press."""

_FIRST_IF_FACTORED, _LARGEST_IF_FACTORED = 3, 12
"""Counts if every increment factors the tangent again: the first of a coarser mesh, and the largest."""

ROUGH = 1e-4
"""Residual at which increments at finite strain end on meshes that serve an estimate: friction is known to 0.02 %."""


@dataclass(frozen=True)
class StepEstimate:
    """Estimated relative error due to the size of the increments, the largest over the ends of the legs.

    Attributes
    ----------
    steps : increments of each automatic leg
    normal_force : relative to the largest over the ends of the legs
    friction_sum : relative to the largest over the ends of the legs, or mu times that normal force if it is larger
    gauges : relative to the largest strain of all gauges, or a twentieth of the depth over the height if that is larger
    dissipation : relative to the dissipation, or to a fiftieth of the external work if that is larger
    met : whether every error is below its tolerance
    runs : in the order of their numbers of increments
    beside : problem on a coarser mesh whose runs these are; None if they are those of the press
    """

    steps: int
    normal_force: float
    friction_sum: float
    gauges: float
    dissipation: float
    met: bool
    tolerance: float = TOLERANCE
    dissipation_tolerance: float = DISSIPATION_TOLERANCE
    runs: tuple[Run, ...] = field(default=(), repr=False, compare=False)
    beside: Problem | None = field(default=None, repr=False, compare=False)

    def as_dict(self) -> dict[str, float | bool]:
        """The estimate as an entry of summary.json."""
        entry = asdict(replace(self, runs=(), beside=None))
        return {key: value for key, value in entry.items() if key not in ("runs", "beside")}

    @property
    def warning(self) -> str:
        """One line with the estimated errors; empty if the tolerances are met."""
        if self.met:
            return ""
        return (
            f"automatic increments stopped at {self.steps} a leg, with estimated errors of "
            f"{100 * self.normal_force:.2g} % in the normal force, {100 * self.friction_sum:.2g} % in the friction "
            f"sum, {100 * self.gauges:.2g} % of the largest strain and {100 * self.dissipation:.2g} % in the "
            "dissipation; give press.steps for more"
        )


def automatic(model: Model) -> bool:
    """Whether the number of increments of any leg is chosen by the error.

    Under the paper's rules of contact or of kinetic friction the solution does not converge with the number of
    increments; there "auto" is a fixed number, `finger3d.mechanics.path.AUTO_START`.
    """
    depends_on_steps = model.rule in STEP_DEPENDENT_RULES or model.friction.depends_on_steps
    return not depends_on_steps and any(leg.steps == "auto" for leg in model.legs)


def with_steps(problem: Problem, steps: int) -> Problem:
    """The problem with `steps` increments in each automatic leg; the condensation is shared."""
    legs = tuple(replace(leg, steps=steps) if leg.steps == "auto" else leg for leg in problem.model.legs)
    return replace(problem, model=replace(problem.model, legs=legs))


def with_scaled_steps(problem: Problem, ratio: float) -> tuple[Problem, float]:
    """The problem in `ratio` times as many increments, and the ratio after rounding to whole numbers.

    Raises
    ------
    Finger3dError
        If all legs have a single increment, which cannot be halved.
    """
    legs = problem.model.legs
    own = [leg.steps if isinstance(leg.steps, int) else AUTO_START for leg in legs]
    counts = [max(1, round(ratio * count)) for count in own]
    if counts == own:
        raise Finger3dError("a single increment cannot be halved")
    scaled = tuple(replace(leg, steps=count) for leg, count in zip(legs, counts, strict=True))
    return replace(problem, model=replace(problem.model, legs=scaled)), sum(counts) / sum(own)


def with_few_increments(problem: Problem, most: int = _FEW) -> Problem:
    """Return the problem with at most so many increments in each leg, as many in one with automatic increments."""
    legs = (
        replace(leg, steps=min(leg.steps, most) if isinstance(leg.steps, int) else most) for leg in problem.model.legs
    )
    return replace(problem, model=replace(problem.model, legs=tuple(legs)))


def increment_error(value: Value, other: Value, ratio: float) -> Value:
    """Estimated error of a quantity in N increments, from its value in `ratio` times as many.

    Examples
    --------
    >>> round(increment_error(1.1, 1.2, 0.5), 12)  # 1 + 1/N in N = 10 and 5 increments
    0.1
    """
    return abs(value - other) / abs(1.0 - 1.0 / ratio)


def refine(
    problem: Problem,
    workspace: Workspace | None = None,
    cancel: Event | None = None,
    advanced: Callable[[int, int, StepResult], None] = lambda done, total, step: None,
    chosen: Callable[[Problem, StepEstimate | None], None] = lambda problem, estimate: None,
) -> Iterator[tuple[tuple[StepResult, ...], StepEstimate | None]]:
    """Yield the results of runs with more and more increments, each with its estimate; the first run has none.

    The iteration ends when three runs meet the tolerances or the largest number of increments is reached.  A run that
    fails is omitted if two with fewer increments converged or one with twice as many does.  If it fails before the
    first automatic leg, none follows.  At finite strain there is one run, in increments chosen on a coarser mesh.

    Parameters
    ----------
    problem, workspace, cancel : see `march`
    advanced : function, optional
        Called after every increment of a run with the number of those solved, of all in the run, and its result.
    chosen : function, optional
        Called before the press itself, where its increments are chosen on a coarser mesh, with it and the estimate.
    """
    workspace = workspace or formulation_of(problem.model).workspace()
    if problem.model.finite_strain:
        yield from _refined_beside(problem, workspace, cancel, advanced, chosen)
        return
    yield from _refined(problem, workspace, cancel, advanced)


def _refined_beside(
    problem: Problem,
    workspace: Workspace,
    cancel: Event | None,
    advanced: Callable[[int, int, StepResult], None],
    chosen: Callable[[Problem, StepEstimate | None], None],
) -> Iterator[tuple[tuple[StepResult, ...], StepEstimate | None]]:
    """Yield the results of one run, in increments chosen on a coarser mesh; of more where these do not converge."""
    beside = next((coarse for _, coarse in coarse_companions(problem)), None)
    if beside is None:  # the mesh is small
        yield from _refined(problem, workspace, cancel, advanced)
        return
    *_, (_, estimate) = _refined(beside, rough_workspace(beside), cancel, lambda done, total, step: None)
    estimate = estimate and replace(estimate, beside=beside)
    first = estimate.steps if estimate else AUTO_START
    for steps in (first, 2 * first):
        counted = with_steps(problem, steps)
        chosen(counted, estimate)
        results = _run(counted, workspace, cancel, advanced)
        if results[-1].outcome.ok or len(results) <= _fixed_first(problem.model):
            break
    yield results, estimate


def rough_workspace(problem: Problem) -> Workspace:
    """Return an empty workspace in which increments at finite strain end at the residual `ROUGH`."""
    if problem.model.finite_strain:
        from finger3d.mechanics.finite_strain.body import FiniteStrainWorkspace  # a press imports what its scene names

        return FiniteStrainWorkspace(target=ROUGH)
    workspace: Workspace = formulation_of(problem.model).workspace()
    return workspace


def _refined(
    problem: Problem, workspace: Workspace, cancel: Event | None, advanced: Callable[[int, int, StepResult], None]
) -> Iterator[tuple[tuple[StepResult, ...], StepEstimate | None]]:
    """Yield the results of runs with twice as many increments each; see `refine`."""
    steps, last = limits(problem.model, problem.size)
    least = 2 if problem.model.finite_strain else _LEAST_RUNS
    runs: list[Run] = []
    failed: tuple[StepResult, ...] = ()
    while steps <= last:
        results = _run(with_steps(problem, steps), workspace, cancel, advanced)
        if not results[-1].outcome.ok:
            again = not failed and len(results) > _fixed_first(problem.model)
            failed = failed or results
            if len(runs) > 1 or not again:
                break
        else:
            runs.append((steps, results))
            estimate = _estimate(problem, runs) if len(runs) > 1 else None
            yield results, estimate
            if estimate and estimate.met and len(runs) >= least:
                return
        steps *= 2
    if not runs:
        yield failed, None


def _fixed_first(model: Model) -> int:
    """Return the number of increments before the first automatic leg."""
    before = itertools.takewhile(lambda leg: leg.steps != "auto", model.legs)
    return sum(int(leg.steps) for leg in before)


def _run(
    problem: Problem, workspace: Workspace, cancel: Event | None, advanced: Callable[[int, int, StepResult], None]
) -> tuple[StepResult, ...]:
    total, results = len(stations(problem.model.legs)), list[StepResult]()
    for step in march(problem, workspace=workspace, cancel=cancel):
        results.append(step)
        advanced(len(results), total, step)
    return tuple(results)


def march_automatic(
    problem: Problem, workspace: Workspace | None = None, cancel: Event | None = None
) -> tuple[tuple[StepResult, ...], StepEstimate | None]:
    """Return the results of a press whose automatic increments are chosen by their error, and the estimated error.

    The estimate is None if no leg has automatic increments or only one run converged.
    """
    if not automatic(problem.model):
        return tuple(march(problem, workspace=workspace, cancel=cancel)), None
    *_, last = refine(problem, workspace, cancel)
    return last


def limits(model: Model, size: PressSize) -> tuple[int, int]:
    """Smallest and largest number of automatic increments in a leg; they depend on the size of the problem only."""
    if model.finite_strain:
        return _FIRST_IF_FACTORED, _LARGEST_IF_FACTORED
    if size.dim == 3 and model.refactorises:
        return 2 * _FIRST, 4 * _FIRST  # a condensation for each length of the increments
    most = (AUTOMATIC_S + size.condensation_s) / size.contact_s / len(model.legs)
    steps = 4 * _FIRST
    while steps < _LARGEST and 2.0 * (2 * steps) <= most:
        steps *= 2
    return _FIRST, steps


def _leg_ends(problem: Problem, results: tuple[StepResult, ...]) -> tuple[StepResult, ...]:
    """Result at the end of every leg."""
    counts = itertools.accumulate(int(leg.steps) for leg in problem.model.legs)
    return tuple(results[count - 1] for count in counts)


def _estimate(problem: Problem, runs: Sequence[Run]) -> StepEstimate:
    """Return the errors of the last run at the ends of the legs, from those before."""
    ends = [
        [_quantities(problem, end) for end in _leg_ends(with_steps(problem, count), results)] for count, results in runs
    ]
    counts, finest = [count for count, _ in runs], ends[-1]
    errors = [errors_of_runs(list(zip(counts, leg, strict=True))) for leg in zip(*ends, strict=True)]
    strains = [name for name, value in finest[-1].items() if name not in _FORCES_AND_ENERGIES and not math.isnan(value)]

    def largest(*names: str) -> float:
        return max((abs(quantities[name]) for quantities in finest for name in names), default=0.0)

    def largest_error(*names: str, least: float = 0.0) -> float:
        error = max((leg.get(name, math.inf) for leg in errors for name in names), default=0.0)
        return error / max(largest(*names), least) if error else 0.0

    model, last = problem.model, _leg_ends(with_steps(problem, counts[-1]), runs[-1][1])
    compression = max(abs(end.target.depth_mm) for end in last) / model.design.height_mm
    normal_force = largest_error("normal_force_N")
    friction_sum = largest_error("friction_sum_N", least=model.friction.largest * largest("normal_force_N"))
    gauges = largest_error(*strains, least=_LEAST_STRAIN * compression)
    dissipation = largest_error("dissipation_mJ", least=_LEAST_DISSIPATION * largest("external_work_mJ"))
    return StepEstimate(
        steps=counts[-1],
        normal_force=normal_force,
        friction_sum=friction_sum,
        gauges=gauges,
        dissipation=dissipation,
        met=max(normal_force, friction_sum, gauges) <= TOLERANCE and dissipation <= DISSIPATION_TOLERANCE,
        runs=tuple(runs),
    )


_FORCES_AND_ENERGIES = ("normal_force_N", "friction_sum_N", "dissipation_mJ", "external_work_mJ")
"""Quantities that determine the number of increments, beside the strains of all gauges."""


def _quantities(problem: Problem, result: StepResult) -> dict[str, float]:
    """Quantities by name whose errors determine the number of increments."""
    measured = measure(problem.points, result)
    strains = {column: result.readings[column] for column in of_kind(result.readings, "gauge")}
    return {name: measured[name] for name in _FORCES_AND_ENERGIES} | by_key(strains)


def step_error(
    problem: Problem, quantities: Mapping[str, float], measurement: Measurement, ratio: float
) -> dict[str, float]:
    """Error by name due to the increments, from one further run on the same condensation.

    Parameters
    ----------
    problem : Problem
    quantities : mapping
        Quantities by name in the increments of the problem.
    measurement : callable
        Returns these quantities at the end of a run.
    ratio : float
        Increments of the further run over those of the problem.
    """
    trial, ratio = with_scaled_steps(problem, ratio)
    return errors_between(quantities, measurement(trial, all_steps(trial, cuts=FEW_CUTS)[-1]), ratio)


def errors_between(quantities: Mapping[str, float], others: Mapping[str, float], ratio: float) -> dict[str, float]:
    """Error by name of quantities, from those in `ratio` times as many increments; see `increment_error`."""
    errors = {name: increment_error(value, others[name], ratio) for name, value in quantities.items()}
    return {name: float(error) for name, error in errors.items() if math.isfinite(error)}


def errors_of_runs(runs: Sequence[tuple[int, Mapping[str, float]]]) -> dict[str, float]:
    """Return the errors by name of the quantities of the last run, the largest that any two successive runs give.

    The error that earlier runs give falls with the power 3/2 of the number of increments.

    Parameters
    ----------
    runs : number of increments in an automatic leg, and quantities by name, of two runs or more

    Examples
    --------
    >>> round(errors_of_runs([(5, {"x": 1.8}), (10, {"x": 1.0}), (40, {"x": 1.0})])["x"], 12)  # the last two agree
    0.1
    """
    largest: dict[str, float] = {}
    for (few, coarse), (many, fine) in itertools.pairwise(runs):
        for name, error in errors_between(fine, coarse, few / many).items():
            largest[name] = max(largest.get(name, 0.0), error * (many / runs[-1][0]) ** _FALL)
    return largest


def all_steps(
    problem: Problem, workspace: Workspace | None = None, cuts: int = CUTS, cancel: Event | None = None
) -> list[StepResult]:
    """Solve all increments and return their results; for the workspace, cuts and cancel see `march`.

    Raises
    ------
    Finger3dError
        If an increment does not converge.
    """
    results = list(march(problem, workspace=workspace, cancel=cancel, cuts=cuts))
    if not results:
        raise Finger3dError("there are no increments to march")
    if not results[-1].outcome.ok:
        failed = results[-1].outcome
        raise Finger3dError(f"a run with {problem.model.mesh.size_mm:.4g} mm did not converge ({failed})")
    return results


def rough_steps(problem: Problem, cancel: Event | None = None) -> list[StepResult]:
    """Solve all increments on a mesh that serves an estimate: at finite strain to the residual `ROUGH`.

    Raises
    ------
    Finger3dError
        If an increment does not converge.
    """
    return all_steps(problem, rough_workspace(problem), FEW_CUTS, cancel)


def with_increments_of(legs: tuple[Leg, ...], count: int) -> tuple[Leg, ...]:
    """Return the legs with the automatic increments of a press that had `count` increments in all."""
    automatic_legs = sum(leg.steps == "auto" for leg in legs)
    fixed = sum(leg.steps for leg in legs if isinstance(leg.steps, int))
    each = (count - fixed) // max(1, automatic_legs)
    return tuple(replace(leg, steps=each) if leg.steps == "auto" else leg for leg in legs)
