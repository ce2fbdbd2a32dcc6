"""Increments chosen by step halving: doubled until the friction sum and the dissipation change by less than asked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from finger3d.history import Frame, measure
from finger3d.solve import AUTO_START, Problem, march

FRICTION_TOLERANCE = 0.01
DISSIPATION_TOLERANCE = 0.05
"""The error of both falls as 1 / increments; that of the dissipation is larger (validation/REFERENCES.md, 2.4)."""

_LARGEST = 640
# dissipation below this share of the work is round-off of a press that hardly slips
_FLOOR = 1e-4


@dataclass(frozen=True)
class StepEstimate:
    """What halving the increments changed, relative; an estimate of the error that is left.

    Attributes
    ----------
    steps : increments of each automatic leg
    friction_sum, dissipation : largest relative change over the ends of the legs
    met : whether both are below their tolerance
    """

    steps: int
    friction_sum: float
    dissipation: float
    met: bool
    friction_sum_tolerance: float = FRICTION_TOLERANCE
    dissipation_tolerance: float = DISSIPATION_TOLERANCE

    def as_dict(self) -> dict[str, Any]:
        """For summary.json."""
        return asdict(self)


def automatic(problem: Problem) -> bool:
    """Whether any leg asks for automatic increments."""
    return any(leg.steps == "auto" for leg in problem.model.legs)


def with_steps(problem: Problem, steps: int) -> Problem:
    """The problem with `steps` increments in each automatic leg; the condensation is shared."""
    legs = tuple(replace(leg, steps=steps) if leg.steps == "auto" else leg for leg in problem.model.legs)
    return replace(problem, model=replace(problem.model, legs=legs))


def refine(problem: Problem) -> Iterator[tuple[tuple[Frame, ...], StepEstimate | None]]:
    """Frames and estimate of ever finer increments; ends when the estimate is met, at the limit, or at a failure."""
    steps, before = AUTO_START, None
    while steps <= _LARGEST:
        trial = with_steps(problem, steps)
        frames = tuple(march(trial))
        ends = _ends(trial, frames)
        estimate = None if before is None else _compare(steps, before, ends)
        yield frames, estimate
        if (estimate and estimate.met) or not frames[-1].outcome.ok:
            return
        steps, before = 2 * steps, ends


def _ends(problem: Problem, frames: tuple[Frame, ...]) -> list[tuple[float, float, float]]:
    """Friction sum, dissipation and work at the end of every leg reached."""
    counts = [leg.steps for leg in problem.model.legs]
    out, at = [], 0
    for count in counts:
        at += int(count)
        if at <= len(frames):
            numbers = measure(problem.points, frames[at - 1])
            out.append((numbers["friction_sum_N"], numbers["dissipation_mJ"], abs(numbers["external_work_mJ"])))
    return out


def _compare(steps: int, coarse: list[Any], fine: list[Any]) -> StepEstimate:
    largest = max((f[0] for f in fine), default=0.0)
    work = max((f[2] for f in fine), default=0.0)
    pairs = list(zip(coarse, fine, strict=False))
    friction = max((abs(f[0] - c[0]) / largest for c, f in pairs if largest), default=0.0)
    lost = max((abs(f[1] - c[1]) / max(f[1], _FLOOR * work) for c, f in pairs if work), default=0.0)
    return StepEstimate(steps, friction, lost, friction <= FRICTION_TOLERANCE and lost <= DISSIPATION_TOLERANCE)
