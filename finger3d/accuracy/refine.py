"""Mesh refinement until the estimated error of every main quantity is below a tolerance.

Two lengths are free, that of the contact (its edge, the border of stick and slip, what a gauge below it reads) and that
of the body far from it (the corners of the base).  A second coarse run, coarse at the contact only, tells which of them
the error comes from.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace

from finger3d._types import Tree
from finger3d.accuracy.companions import FACTOR, companion
from finger3d.accuracy.estimate import compared, main_numbers
from finger3d.accuracy.richardson import ORDER, Kind, Quantity, largest_readings
from finger3d.errors import Finger3dError, UnresolvedError
from finger3d.mechanics.build import build
from finger3d.mechanics.model import MeshOptions, Model
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.step_halving import last_step

MAX_ROUNDS = 8
_MIN_SHARE = 0.3  # of the difference to the companion: an edge length that causes less is kept
_FACTOR_RANGE = (0.4, 0.85)  # a round changes an edge length at least and at most by these factors
_SAFETY = 0.9  # of the tolerance, so that the last round does not just miss it
_PRESS_TO_ROUND = 1.3  # a press takes so many times its last round, whose contact it marches again and draws
_EXPONENT = {2: 1.2, 3: 1.6}  # seconds grow with this power of the unknowns (measured from 161 000 to 523 000 in 3D)


@dataclass(frozen=True)
class Round:
    """One mesh of the refinement.

    Attributes
    ----------
    error, number : largest estimated error, relative (see `relative_errors`), and the number that has it
    seconds : of this round, estimate included
    """

    size_mm: float
    base_size_mm: float
    dofs: int
    error: float
    number: str
    seconds: float

    def line(self, count: int) -> str:
        """Return the round as one line of text."""
        return (
            f"round {count}: size {self.size_mm:.4g} mm, base {self.base_size_mm:.4g} mm, {self.dofs} dofs, "
            f"error {100 * self.error:.2g} % ({self.number}), {self.seconds:.1f} s"
        )


@dataclass(frozen=True)
class Refinement:
    """Result of a mesh refinement.

    Attributes
    ----------
    mesh : edge lengths of the best round
    problem : condensed on them, if that was the last round; memory is not kept for others
    stopped : why it ended: the tolerance is met, or the time, the memory, the rounds are used up
    """

    tolerance: float
    mesh: MeshOptions
    rounds: tuple[Round, ...]
    stopped: str
    problem: Problem | None = field(default=None, repr=False, compare=False)

    @property
    def best(self) -> Round:
        """The round with the smallest error."""
        return min(self.rounds, key=lambda r: r.error)

    @property
    def met(self) -> bool:
        """Whether the estimate is below the tolerance."""
        return self.best.error <= self.tolerance

    @property
    def warning(self) -> str:
        """One line where the tolerance was not met, else empty."""
        if self.met:
            return ""
        return (
            f"mesh.tolerance = {self.tolerance:g} was not met ({self.stopped}): the best mesh leaves an estimated "
            f"error of {self.best.error:.2g} in {self.best.number}"
        )

    def as_dict(self) -> Tree:
        """Return the entry of summary.json."""
        return {
            "tolerance": self.tolerance,
            "met": self.met,
            "stopped": self.stopped,
            "rounds": [asdict(r) for r in self.rounds],
        }


def refine_mesh(
    model: Model,
    tolerance: float,
    max_seconds: float | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Refinement:
    """Refine the mesh of a model until its estimated errors are below a tolerance.

    Parameters
    ----------
    model : with the edge lengths of the first round
    tolerance : relative, see `relative_errors`
    max_seconds : no round is begun that is forecast to end later, output included
    say : receives a line for each round

    Raises
    ------
    Finger3dError
        If even the first mesh cannot be generated or pressed.
    """
    start, rounds = time.perf_counter(), list[Round]()
    options, problem = model.mesh, None
    stopped = f"{MAX_ROUNDS} rounds"
    while len(rounds) < MAX_ROUNDS:
        problem = None  # two factors at once would halve the mesh that memory allows
        try:
            problem, done, wanted = _run_round(replace(model, mesh=options), tolerance)
        except UnresolvedError as error:
            if error.size_mm is None or error.size_mm >= options.size_mm:
                raise
            options = replace(options, size_mm=error.size_mm)
            continue
        except (Finger3dError, MemoryError) as error:
            if not rounds:
                raise
            stopped = f"no finer mesh: {error or 'out of memory'}"
            break
        rounds.append(done)
        say(done.line(len(rounds)))
        if done.error <= tolerance:
            stopped = "met"
            break
        left = math.inf if max_seconds is None else max_seconds - (time.perf_counter() - start)
        found = _affordable(options, wanted, done.seconds, left, 3 if model.domain == "solid" else 2)
        if found is None:
            stopped = f"max_seconds = {max_seconds:g}"
            break
        options = found
    best = min(rounds, key=lambda r: r.error)
    mesh = replace(model.mesh, size_mm=best.size_mm, base_size_mm=best.base_size_mm)
    return Refinement(tolerance, mesh, tuple(rounds), stopped, problem if best is rounds[-1] else None)


def relative_errors(numbers: Mapping[str, float], errors: Mapping[str, float]) -> dict[str, float]:
    """Return relative errors; of lengths relative to that of the contact, of readings to the largest of their kind."""
    readings, found = largest_readings(numbers), {}
    for name, error in errors.items():
        kind = Quantity.of(name).kind
        if kind.is_length:
            scale = numbers["contact_half_length_mm"]
        else:
            scale = readings.get(kind, abs(numbers[name]))
        found[name] = error / scale if scale > 0.0 else (math.inf if error > 0.0 else 0.0)
    return found


def largest_error(numbers: Mapping[str, float], errors: Mapping[str, float]) -> tuple[str, float]:
    """Return the number with the largest relative error, and that error."""
    relative = relative_errors(numbers, errors)
    name = max(relative, key=lambda k: relative[k])
    return name, relative[name]


def controlled_quantities(problem: Problem, names: Iterable[str]) -> list[str]:
    """Return the quantities that a tolerance applies to: forces, strains, and lengths but the stick length of a solid.

    The stick zone of a solid is often less than three points wide on any affordable mesh, and then of unknown length.
    Areas have bars of the same kind as lengths.
    """
    left_out = {"stick_half_length_mm"} if problem.dim == 3 else set()
    return [name for name in names if name not in left_out and Quantity.of(name).kind is not Kind.AREA]


def _run_round(model: Model, tolerance: float) -> tuple[Problem, Round, MeshOptions]:
    """Press on one mesh; return its problem, its round, and the edge lengths to try next."""
    start = time.perf_counter()
    problem = build(model)
    frame = last_step(problem)
    numbers = main_numbers(problem, frame)
    other = companion(problem)
    last = last_step(other)
    errors = compared(problem, frame, other, last)
    number, error = largest_error(numbers, {name: errors[name] for name in controlled_quantities(problem, errors)})
    # a finer companion changes both lengths, so that their effects cannot be separated
    coarse = main_numbers(other, last) if other.model.mesh.base_size_mm >= model.mesh.base_size_mm else None
    sizes = _next_sizes(problem, number, error, tolerance, numbers, coarse)
    seconds = time.perf_counter() - start
    options = model.mesh
    dofs = int(problem.part.stiffness.upper.shape[0])
    return problem, Round(options.size_mm, options.base_size_mm, dofs, error, number, seconds), sizes


def _next_sizes(
    problem: Problem,
    number: str,
    error: float,
    tolerance: float,
    fine: Mapping[str, float],
    coarse: Mapping[str, float] | None,
) -> MeshOptions:
    """Return smaller edge lengths of contact, base or both, according to the quantity with the largest error."""
    options = problem.model.mesh
    if error <= tolerance:
        return options
    is_length = Quantity.of(number).kind.is_length
    shares = (1.0, 0.0) if is_length else _error_shares(problem, number, fine, coarse)
    power = 1.0 if is_length else ORDER
    factor = min(max((_SAFETY * tolerance / error) ** (1.0 / power), _FACTOR_RANGE[0]), _FACTOR_RANGE[1])
    size = options.size_mm * (factor if shares[0] >= _MIN_SHARE else 1.0)
    base = options.base_size_mm * (factor if shares[1] >= _MIN_SHARE else 1.0)
    return replace(options, size_mm=_rounded(size), base_size_mm=_rounded(max(size, base)))


def _error_shares(
    problem: Problem, number: str, fine: Mapping[str, float], coarse: Mapping[str, float] | None
) -> tuple[float, float]:
    """Return the shares of the difference to the companion that the edge lengths of contact and base cause."""
    options = problem.model.mesh
    size = min(FACTOR * options.size_mm, options.base_size_mm)
    if coarse is None or size < 1.1 * options.size_mm:
        return 1.0, 1.0
    third = build(replace(problem.model, mesh=replace(_with_swept_mesher(problem, options), size_mm=size)))
    middle = main_numbers(third, last_step(third))[number]
    contact, base = abs(fine[number] - middle), abs(middle - coarse[number])
    total = contact + base
    return (contact / total, base / total) if total > 0.0 else (1.0, 0.0)


def _with_swept_mesher(problem: Problem, options: MeshOptions) -> MeshOptions:
    return replace(options, mesher="swept") if problem.model.design.section() is not None else options


def _affordable(now: MeshOptions, wanted: MeshOptions, seconds: float, left: float, dim: int) -> MeshOptions | None:
    """Return the wanted edge lengths, or longer ones if time is short; None if no refinement is affordable."""
    left /= _PRESS_TO_ROUND
    factor = min(wanted.size_mm / now.size_mm, wanted.base_size_mm / now.base_size_mm)
    power = dim * _EXPONENT[dim]
    if seconds * factor**-power <= left:
        return wanted
    least = (seconds / left) ** (1.0 / power) if left > 0.0 else 1.0
    if least > _FACTOR_RANGE[1]:
        return None
    # as far as the time allows, each length in proportion
    part = math.log(least) / math.log(factor)
    size, base = (
        b * (w / b) ** part for b, w in ((now.size_mm, wanted.size_mm), (now.base_size_mm, wanted.base_size_mm))
    )
    return replace(now, size_mm=_rounded(size), base_size_mm=_rounded(max(size, base)))


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
