"""Number of increments, chosen by the estimated error of the result.

The path is solved in N, 2 N, 4 N, ... increments.  The error of a quantity x(N) is assumed to be proportional to 1/N;
then each pair of successive counts gives an estimate,

    error of x(n) = |x(N) - x(2 N)| / (1/N - 1/(2 N)) / n,

of which the largest is taken, since two counts may agree by chance.  ``validation/error_bars.py`` measures how often
the true error is within twice this estimate.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from threading import Event
from typing import TypeAlias

from finger3d._cost import AUTOMATIC_S, PressSize
from finger3d.contact.rules import STEP_DEPENDENT_RULES
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.path import AUTO_START, stations
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.readings.columns import by_key, of_kind
from finger3d.mechanics.results.history import StepResult, measure

Measurement = Callable[[Problem, StepResult], dict[str, float]]
"""Quantities by name, measured at the end of a press."""

Run: TypeAlias = tuple[int, tuple[StepResult, ...]]
"""Number of increments in an automatic leg, and the results of all increments."""

TOLERANCE = 0.01
"""Relative error allowed in normal force, friction sum and strain; a strain's is relative to the largest strain."""

DISSIPATION_TOLERANCE = 0.05
"""Relative error allowed in the dissipation."""

FLOOR = 1e-4
"""Share of the external work below which the dissipation is not resolved: only a few points slip, in the first
increments."""

_PAIRS = {2: 4, 3: 3}
"""Largest number of pairs of successive counts in an estimate, by dimension.  With three pairs, one of eight random
sections had an estimate below 1 % and an error of 1.8 %; in a solid four pairs would double the time."""

_LEAST_RUNS = {2: 4, 3: 3}
"""Least number of runs before the tolerances may be met; three sometimes agree by chance."""

_FIRST, _LARGEST = 5, 640
_FIRST_IF_FACTORED, _LARGEST_IF_FACTORED = 3, 12
"""Counts if every increment factors the stiffness again: 3, 6 and 12 increments cost twice as much as 10."""


@dataclass(frozen=True)
class StepEstimate:
    """Estimated relative error due to the size of the increments, the largest over the ends of the legs.

    Attributes
    ----------
    steps : increments of each automatic leg
    normal_force, friction_sum : relative to the largest over the ends of the legs
    gauges : relative to the largest strain of all gauges
    dissipation : relative, where dissipation is above the floor
    dissipation_floor_mJ : `FLOOR` times the largest external work
    dissipation_resolved : False if the dissipation at the end is below the floor, so that its own error is not limited
    met : whether every error is below its tolerance; that of the dissipation counts only above the floor
    runs : in the order of their numbers of increments
    """

    steps: int
    normal_force: float
    friction_sum: float
    gauges: float
    dissipation: float
    dissipation_floor_mJ: float
    dissipation_resolved: bool
    met: bool
    tolerance: float = TOLERANCE
    dissipation_tolerance: float = DISSIPATION_TOLERANCE
    runs: tuple[Run, ...] = field(default=(), repr=False, compare=False)

    def as_dict(self) -> dict[str, float | bool]:
        """The estimate as an entry of summary.json."""
        return {key: value for key, value in asdict(replace(self, runs=())).items() if key != "runs"}

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

    @property
    def advice(self) -> str:
        """One line if the dissipation is too small to be resolved, else empty."""
        if self.dissipation_resolved:
            return ""
        return (
            f"the dissipation is below {self.dissipation_floor_mJ:.2g} mJ, {FLOOR:g} of the external work; the "
            "increments do not resolve it, and its error_estimate says how far it is off"
        )


def automatic(model: Model) -> bool:
    """Whether the number of increments of any leg is chosen by the error.

    Under the paper's rules of contact or of kinetic friction the solution does not converge with the number of
    increments; there "auto" is a fixed number, `finger3d.mechanics.march.path.AUTO_START`.
    """
    depends_on_steps = model.rule in STEP_DEPENDENT_RULES or model.friction.depends_on_steps
    return not depends_on_steps and any(leg.steps == "auto" for leg in model.legs)


def with_steps(problem: Problem, steps: int) -> Problem:
    """The problem with `steps` increments in each automatic leg; the condensation is shared."""
    legs = tuple(replace(leg, steps=steps) if leg.steps == "auto" else leg for leg in problem.model.legs)
    return replace(problem, model=replace(problem.model, legs=legs))


def increment_error(counts: Sequence[int], values: Sequence[float], count: int) -> float:
    """Estimated error of a quantity computed in `count` increments.

    Parameters
    ----------
    counts, values : sequences
        At least two numbers of increments in ascending order, and the values of the quantity.
    count : int
        A number of increments, whether among `counts` or not.

    Examples
    --------
    >>> increment_error([8, 16, 32], [1.125, 1.0625, 1.03125], 32)  # 1 + 1/N
    0.03125
    """
    runs = list(zip(counts, values, strict=True))
    rates = [abs(b - a) / abs(1.0 / m - 1.0 / n) for (n, a), (m, b) in zip(runs, runs[1:], strict=False)]
    return max(rates) / count


def refine(
    problem: Problem,
    workspace: Workspace | None = None,
    cancel: Event | None = None,
    advanced: Callable[[int, int, StepResult], None] = lambda done, total, step: None,
) -> Iterator[tuple[tuple[StepResult, ...], StepEstimate | None]]:
    """Yield the results of runs with more and more increments, each with its estimate; the first run has none.

    The iteration ends when the tolerances are met or the largest number of increments is reached.  A run that fails is
    omitted if one with fewer increments converged or one with twice as many does.  If it fails before the first
    automatic leg, none follows.

    Parameters
    ----------
    problem, workspace, cancel : see `march`
    advanced : function, optional
        Called after every increment of a run with the number of those solved, of all in the run, and its result.
    """
    workspace = workspace or formulation_of(problem.model).workspace()
    steps, last = limits(problem.model, problem.size)
    runs: list[Run] = []
    failed: tuple[StepResult, ...] = ()
    while steps <= last:
        results = _run(with_steps(problem, steps), workspace, cancel, advanced)
        if not results[-1].outcome.ok:
            if runs:
                return
            again = not failed and len(results) > _fixed_first(problem.model)
            failed = failed or results
            if not again:
                break
        else:
            runs.append((steps, results))
            estimate = _estimate(problem, runs) if len(runs) > 1 else None
            yield results, estimate
            if estimate and estimate.met:
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
        return _FIRST, 4 * _FIRST  # a condensation for each length of the increments
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
    used = runs[-(_PAIRS[problem.dim] + 1) :]
    counts = [count for count, _ in used]
    ends = [
        [_quantities(problem, end) for end in _leg_ends(with_steps(problem, count), results)] for count, results in used
    ]
    finest = ends[-1]
    errors = [
        {name: increment_error(counts, [run[leg][name] for run in ends], counts[-1]) for name in quantities}
        for leg, quantities in enumerate(finest)
    ]
    strains = [name for name, value in finest[-1].items() if name not in _FORCES_AND_ENERGIES and not math.isnan(value)]
    floor = FLOOR * max(abs(quantities["external_work_mJ"]) for quantities in finest)

    def largest_error(*names: str) -> float:
        largest = max((abs(quantities[name]) for quantities in finest for name in names), default=0.0)
        error = max((leg[name] for leg in errors for name in names), default=0.0)
        return error / largest if largest else 0.0

    dissipation = [(end["dissipation_mJ"], error["dissipation_mJ"]) for end, error in zip(finest, errors, strict=True)]
    resolved = [error / max(value, floor) for value, error in dissipation if value + error > floor]
    normal_force, friction_sum = largest_error("normal_force_N"), largest_error("friction_sum_N")
    gauges, dissipation_error = largest_error(*strains), max(resolved, default=0.0)
    return StepEstimate(
        steps=counts[-1],
        normal_force=normal_force,
        friction_sum=friction_sum,
        gauges=gauges,
        dissipation=dissipation_error,
        dissipation_floor_mJ=floor,
        dissipation_resolved=sum(dissipation[-1]) > floor or not any(dissipation[-1]),
        met=len(runs) >= _LEAST_RUNS[problem.dim]
        and max(normal_force, friction_sum, gauges) <= TOLERANCE
        and dissipation_error <= DISSIPATION_TOLERANCE,
        runs=tuple(runs),
    )


_FORCES_AND_ENERGIES = ("normal_force_N", "friction_sum_N", "dissipation_mJ", "external_work_mJ")
"""Quantities that determine the number of increments, beside the strains of all gauges."""


def _quantities(problem: Problem, result: StepResult) -> dict[str, float]:
    """Quantities by name whose errors determine the number of increments."""
    measured = measure(problem.points, result)
    strains = {column: result.readings[column] for column in of_kind(result.readings, "gauge")}
    return {name: measured[name] for name in _FORCES_AND_ENERGIES} | by_key(strains)


COUNT_RATIOS: dict[str, tuple[float, float]] = {"up": (2.0, 4.0), "both": (0.5, 2.0), "down": (0.25, 0.5)}
"""Ratios of the counts of increments that an error is estimated from to the count of the result, the best first."""


def step_error(
    problem: Problem, quantities: Mapping[str, float], measurement: Measurement, ratios: str = "up"
) -> dict[str, float]:
    """Error by name due to the increments, from two further runs on the same condensation.

    Parameters
    ----------
    problem : Problem
    quantities : mapping
        Quantities by name in the increments of the problem.
    measurement : callable
        Returns these quantities at the end of a run.
    ratios : str
        Key of `COUNT_RATIOS`.
    """
    legs = problem.model.legs
    own = [leg.steps if isinstance(leg.steps, int) else AUTO_START for leg in legs]
    runs = {sum(own): dict(quantities)}
    for ratio in COUNT_RATIOS[ratios]:
        counts = [max(1, round(ratio * count)) for count in own]
        if sum(counts) not in runs:
            changed = tuple(replace(leg, steps=count) for leg, count in zip(legs, counts, strict=True))
            trial = replace(problem, model=replace(problem.model, legs=changed))
            runs[sum(counts)] = measurement(trial, last_step(trial))
    if len(runs) < 2:
        raise Finger3dError("a single increment cannot be halved")
    return errors_from_counts(runs, sum(own))


def errors_from_counts(runs: Mapping[int, Mapping[str, float]], count: int) -> dict[str, float]:
    """Error by name of the quantities in `count` increments, from the quantities in several counts of increments."""
    counts = sorted(runs)
    errors = {name: increment_error(counts, [runs[n][name] for n in counts], count) for name in runs[count]}
    return {name: float(error) for name, error in errors.items() if math.isfinite(error)}


def choices_of_counts(own_s: float, companion_s: float, budget_s: float) -> list[tuple[bool, str]]:
    """Return the meshes and counts of increments that the error due to the increments may be estimated on.

    Parameters
    ----------
    own_s, companion_s : float
        Seconds of all increments on the mesh of the problem and on its companion.
    budget_s : float
        Seconds that the estimate may take.

    Returns
    -------
    list of (on_own_mesh, ratios)
        Those that the budget allows, the best first, then fewer increments on the companion, and on the mesh itself.
        `ratios` is a key of `COUNT_RATIOS`.
    """
    seconds = {True: own_s, False: companion_s}
    choices = [(own, ratios) for ratios in ("up", "both") for own in (True, False)]
    affordable = [(own, ratios) for own, ratios in choices if sum(COUNT_RATIOS[ratios]) * seconds[own] <= budget_s]
    return [*affordable, (False, "down"), (True, "down")]


def last_step(problem: Problem) -> StepResult:
    """Solve all increments and return the result of the last.

    Raises
    ------
    Finger3dError
        If an increment does not converge.
    """
    result = None
    for result in march(problem):
        if not result.outcome.ok:
            raise Finger3dError(f"a run with {problem.model.mesh.size_mm:.4g} mm did not converge ({result.outcome})")
    if result is None:
        raise Finger3dError("there are no increments to march")
    return result


def with_increments_of(legs: tuple[Leg, ...], count: int) -> tuple[Leg, ...]:
    """Return the legs with the automatic increments of a press that had `count` increments in all."""
    automatic_legs = sum(leg.steps == "auto" for leg in legs)
    fixed = sum(leg.steps for leg in legs if isinstance(leg.steps, int))
    each = (count - fixed) // max(1, automatic_legs)
    return tuple(replace(leg, steps=each) if leg.steps == "auto" else leg for leg in legs)
