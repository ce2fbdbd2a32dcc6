"""Number of increments, chosen by the error that they leave, and that error.

A press is marched in N, 2 N, 4 N, ... increments.  The error of a number x(N) is taken to fall as 1/N, so that each
pair of successive counts tells it,

    error of x(n) = |x(N) - x(2 N)| / (1/N - 1/(2 N)) / n,

and the largest of several pairs is kept: two counts may agree by chance, three in a row hardly do.  How often the true
error lies within twice this estimate is measured by ``validation/error_bars.py``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from threading import Event
from typing import Any

from finger3d.contact.rules import STEP_DEPENDENT_RULES
from finger3d.errors import Finger3dError
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.solve import march

Told = Callable[[Problem, StepResult], dict[str, float]]

TOLERANCE = 0.01
"""Of normal force and friction sum, relative; of a gauge's strain, relative to the largest of all gauges."""

DISSIPATION_TOLERANCE = 0.05
FLOOR = 1e-4
"""Share of the external work below which dissipation is not resolved: it is that of a few points that slip early."""

_PAIRS = {2: 4, 3: 3}
"""Pairs of successive counts that make the estimate, at most, by dimension. With three, one section of eight drawn at
random was called good to 1 % with an error of 1.8 %; a solid would take twice as long with four."""

_LEAST_RUNS = {2: 4, 3: 3}
"""Runs before a tolerance may be met; three still agree by chance now and then, and in a section one more is cheap."""

_FIRST, _LARGEST = 5, 640
_FIRST_IF_FACTORED, _LARGEST_IF_FACTORED = 3, 12
"""Where every increment factors the stiffness anew: 3, 6 and 12 take twice as long as 10 alone."""


@dataclass(frozen=True)
class StepEstimate:
    """Estimated error that the increments leave, relative; the largest over the ends of the legs.

    Attributes
    ----------
    steps : increments of each automatic leg
    normal_force, friction_sum : relative to the largest over the ends of the legs
    gauges : relative to the largest strain of all gauges
    dissipation : relative, where dissipation is above the floor
    dissipation_floor_mJ : `FLOOR` times the largest external work
    dissipation_resolved : False if the dissipation at the end is below the floor, so that its own error is not limited
    met : whether every error is below its tolerance, for dissipation if it is above the floor
    levels : number of increments of a leg, and the frames at the ends of the legs, of every run
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
    levels: tuple[tuple[int, tuple[StepResult, ...]], ...] = field(default=(), repr=False, compare=False)

    def as_dict(self) -> dict[str, Any]:
        """For summary.json."""
        return {key: value for key, value in asdict(replace(self, levels=())).items() if key != "levels"}

    @property
    def warning(self) -> str:
        """One line with the errors that are left, empty if the tolerances are met."""
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
    """Whether any leg asks for increments chosen by their error.

    Under the paper's rules of contact or of kinetic friction the result depends on the increments and has no limit
    that more of them approach; there "auto" is a fixed number, `finger3d.mechanics.problem.AUTO_START`.
    """
    depends_on_steps = model.rule in STEP_DEPENDENT_RULES or model.friction.depends_on_steps
    return not depends_on_steps and any(leg.steps == "auto" for leg in model.legs)


def with_steps(problem: Problem, steps: int) -> Problem:
    """The problem with `steps` increments in each automatic leg; the condensation is shared."""
    legs = tuple(replace(leg, steps=steps) if leg.steps == "auto" else leg for leg in problem.model.legs)
    return replace(problem, model=replace(problem.model, legs=legs))


def remaining(counts: Sequence[int], values: Sequence[float], at: int) -> float:
    """Estimated error of a number in `at` increments, from its values in successive counts of increments.

    Parameters
    ----------
    counts, values : at least two, ordered by count
    at : a count, among those given or not

    Examples
    --------
    >>> remaining([8, 16, 32], [1.125, 1.0625, 1.03125], 32)  # 1 + 1/N
    0.03125
    """
    runs = list(zip(counts, values, strict=True))
    rates = [abs(b - a) / abs(1.0 / m - 1.0 / n) for (n, a), (m, b) in zip(runs, runs[1:], strict=False)]
    return max(rates) / at


def refine(
    problem: Problem, workspace: Workspace | None = None, cancel: Event | None = None
) -> Iterator[tuple[tuple[StepResult, ...], StepEstimate | None]]:
    """Frames and estimate of ever more increments; none after the first run, and none is met too early.

    Ends when the estimate is met or the limit is reached.  A run that fails is left out if one with fewer increments
    succeeded or one with twice as many does.  Workspace and event are those of `march`.
    """
    workspace = workspace or problem.model.formulation.workspace()
    steps, last = limits(problem.model, problem.part.stiffness.upper.shape[0], len(problem.surface.nodes))
    levels: list[tuple[int, tuple[StepResult, ...]]] = []
    failed: tuple[StepResult, ...] = ()
    while steps <= last:
        trial = with_steps(problem, steps)
        frames = tuple(march(trial, workspace=workspace, cancel=cancel))
        if not frames[-1].outcome.ok:
            if levels:
                return
            if failed:
                break
            failed = frames
        else:
            levels.append((steps, _ends(trial, frames)))
            estimate = _estimate(problem, levels) if len(levels) > 1 else None
            yield frames, estimate
            if estimate and estimate.met:
                return
        steps *= 2
    if not levels:
        yield failed, None


def marched(
    problem: Problem, workspace: Workspace | None = None, cancel: Event | None = None
) -> tuple[tuple[StepResult, ...], StepEstimate | None]:
    """Frames of a press, its automatic increments chosen; the estimate is None where none are or no run told it."""
    if not automatic(problem.model):
        return tuple(march(problem, workspace=workspace, cancel=cancel)), None
    *_, last = refine(problem, workspace, cancel)
    return last


def limits(model: Model, dofs: float, contact_points: float) -> tuple[int, int]:
    """Fewest and most automatic increments of a leg; by the size of the problem, so that every run has the same."""
    if model.formulation.finite_strain:
        return _FIRST_IF_FACTORED, _LARGEST_IF_FACTORED
    dim = 3 if model.domain == "solid" else 2
    if dim == 3 and model.formulation.refactorises:
        return _FIRST, 4 * _FIRST  # every length of increments takes a condensation of its own
    budget = WORTH_S[dim] + condensation_s(dofs, dim)
    most = budget / contact_s(contact_points, dim) / len(model.legs)
    steps = 4 * _FIRST
    while steps < _LARGEST and 2.0 * (2 * steps) <= most:
        steps *= 2
    return _FIRST, steps


WORTH_S = {2: 4.0, 3: 4.0}
"""Seconds that automatic increments may take besides those of the condensation: less than the rest of a press."""


def contact_s(points: float, dim: int) -> float:
    """Seconds of one increment on so many contact points of the meshed part, measured on 2 cores."""
    return float(0.0025 + (0.065 * (points / 680.0) ** 2.4 if dim == 3 else 0.038 * (points / 700.0) ** 2.75))


def condensation_s(dofs: float, dim: int) -> float:
    """Seconds of the condensation, likewise."""
    return 6.0 * (dofs / 85_000.0) ** 1.75 if dim == 3 else 0.004 + 8e-6 * dofs


def _ends(problem: Problem, frames: tuple[StepResult, ...]) -> tuple[StepResult, ...]:
    """The frame at the end of every leg."""
    out, at = [], 0
    for leg in problem.model.legs:
        at += int(leg.steps)
        out.append(frames[at - 1])
    return tuple(out)


def _estimate(problem: Problem, levels: Sequence[tuple[int, tuple[StepResult, ...]]]) -> StepEstimate:
    used = levels[-(_PAIRS[problem.dim] + 1) :]
    counts = [count for count, _ in used]
    told = [[_numbers(problem, frame) for frame in ends] for _, ends in used]
    finest = told[-1]
    errors = [
        {name: remaining(counts, [run[leg][name] for run in told], counts[-1]) for name in numbers}
        for leg, numbers in enumerate(finest)
    ]
    strains = [name for name in finest[0] if name.startswith("gauge_") and not math.isnan(finest[-1][name])]
    floor = FLOOR * max(abs(numbers["external_work_mJ"]) for numbers in finest)

    def worst(*names: str) -> float:
        largest = max((abs(numbers[name]) for numbers in finest for name in names), default=0.0)
        error = max((leg[name] for leg in errors for name in names), default=0.0)
        return error / largest if largest else 0.0

    lost = [(numbers["dissipation_mJ"], leg["dissipation_mJ"]) for numbers, leg in zip(finest, errors, strict=True)]
    above = [error / max(value, floor) for value, error in lost if value + error > floor]
    left = (worst("normal_force_N"), worst("friction_sum_N"), worst(*strains), max(above, default=0.0))
    enough = len(levels) >= _LEAST_RUNS[problem.dim]
    return StepEstimate(
        counts[-1], *left,
        dissipation_floor_mJ=floor, dissipation_resolved=sum(lost[-1]) > floor or not any(lost[-1]),
        met=enough and max(left[:3]) <= TOLERANCE and left[3] <= DISSIPATION_TOLERANCE, levels=tuple(levels),
    )  # fmt: skip


def _numbers(problem: Problem, frame: StepResult) -> dict[str, float]:
    """Numbers that the increments are chosen by."""
    numbers = measure(problem.points, frame)
    names = ("normal_force_N", "friction_sum_N", "dissipation_mJ", "external_work_mJ")
    return {name: numbers[name] for name in names} | {f"gauge_{k}": v for k, v in numbers["gauges"].items()}


TIMES: dict[str, tuple[float, float]] = {"up": (2.0, 4.0), "both": (0.5, 2.0), "down": (0.25, 0.5)}
"""Other counts of increments that the error of a count is told by, as multiples of it; the best first."""


def step_error(problem: Problem, numbers: Mapping[str, float], told: Told, way: str = "up") -> dict[str, float]:
    """Error by increments, by name, from two other counts of increments on the same condensation.

    Three counts, since two often agree by chance; see `remaining`.

    Parameters
    ----------
    numbers : in the increments at hand
    way : "up" for two and four times as many, "both" for half and twice, "down" for a quarter and half
    """
    legs = problem.model.legs
    own = [leg.steps if isinstance(leg.steps, int) else AUTO_START for leg in legs]
    runs = {sum(own): dict(numbers)}
    for times in TIMES[way]:
        other = [max(1, round(times * n)) for n in own]
        if sum(other) not in runs:
            parts = tuple(replace(leg, steps=n) for leg, n in zip(legs, other, strict=True))
            trial = replace(problem, model=replace(problem.model, legs=parts))
            runs[sum(other)] = told(trial, last_frame(trial))
    if len(runs) < 2:
        raise Finger3dError("a single increment cannot be halved")
    return error_by_count(runs, sum(own))


def error_by_count(runs: Mapping[int, Mapping[str, float]], at: int) -> dict[str, float]:
    """Error by name of the numbers in `at` increments, from those in several counts."""
    counts = sorted(runs)
    found = {name: remaining(counts, [runs[n][name] for n in counts], at) for name in runs[at]}
    return {k: float(v) for k, v in found.items() if math.isfinite(v)}


def other_counts(here_s: float, beside_s: float, budget: float) -> tuple[bool, str]:
    """Whether the increments are judged on the mesh at hand or beside it, and by which other counts; see `TIMES`."""
    cost = {True: here_s, False: beside_s}
    choices = [(here, way) for way in ("up", "both") for here in (True, False)]
    affordable = ((here, way) for here, way in choices if sum(TIMES[way]) * cost[here] <= budget)
    return next(affordable, (False, "down"))


def last_frame(problem: Problem) -> StepResult:
    """March to the end.

    Raises
    ------
    Finger3dError
        Where an increment does not converge.
    """
    frame = None
    for frame in march(problem):
        if not frame.outcome.ok:
            raise Finger3dError(f"a run with {problem.model.mesh.size_mm:.4g} mm did not converge ({frame.outcome})")
    if frame is None:
        raise Finger3dError("there are no increments to march")
    return frame


def as_solved(legs: tuple[Leg, ...], count: int) -> tuple[Leg, ...]:
    """The legs with their automatic increments as many as `count` frames in all tell."""
    free = [leg for leg in legs if leg.steps == "auto"]
    fixed = sum(leg.steps for leg in legs if isinstance(leg.steps, int))
    each = (count - fixed) // max(1, len(free))
    return tuple(replace(leg, steps=each) if leg.steps == "auto" else leg for leg in legs)
