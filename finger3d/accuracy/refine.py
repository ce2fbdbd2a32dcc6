"""Mesh refinement until the estimated error of one number, the goal, is below a tolerance.

A first mesh whose error is far below the tolerance is made coarser instead, as long as the tolerance is met.  In small
strain the mesh is graded towards the goal by the shares of the cells in its error (`finger3d.accuracy.graded`).  Where
the error is estimated from a companion mesh, two lengths are free, that of the contact and that of the body far from it
(the corners of the base).  A second coarse run, coarse at the contact only, separates their contributions to the error.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

from finger3d._cost import GROWTH, PRESS_TO_ROUND
from finger3d._ranges import four_digits
from finger3d._types import Tree
from finger3d.accuracy.adjoint_bars import NoAdjointBarsError, adjoint_bars, applies, short_press
from finger3d.accuracy.borders import MOST_STICK_REFINEMENT, with_refined_borders
from finger3d.accuracy.estimate import compared, press_numbers
from finger3d.accuracy.graded import cell_growth, finest, graded_sizes
from finger3d.accuracy.richardson import ORDER, ORDERS, Kind, kinds_of, relative_error
from finger3d.errors import Finger3dError, UnresolvedError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import FACTOR, companion
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.step_halving import last_step
from finger3d.mechanics.model import MeshOptions, Model
from finger3d.progress import QUIET, Progress

MAX_ROUNDS = 8
GOAL, ALL = "normal_force_N", "all"
"""Number that a mesh is refined for unless a scene names another, and the name of all numbers together."""

_MIN_SHARE = 0.3  # of the difference to the companion: an edge length that causes less is kept
_FACTOR_RANGE = (0.4, 0.85)  # a round changes an edge length at least and at most by these factors
_COARSEN = 0.25
"""Error over the tolerance from which a mesh is not made coarser: the next would hardly have fewer unknowns."""

_WORTHWHILE = 0.7
"""Unknowns of a coarser mesh over those of the one before, above which no coarser one is tried."""

_FEWEST_POINTS = 8
"""Contact points that the half-length of contact keeps on a coarser mesh."""

_AT_STICK = (1.5, 4.0)  # a round makes edges at the border of stick at least and at most so much shorter, by halving

_SAFETY = 0.9  # of the tolerance, so that the last round does not just miss it


@dataclass(frozen=True)
class Round:
    """One mesh of the refinement.

    Attributes
    ----------
    gauge_refinement, stick_refinement : edge length at the contact over that around gauges and at the border of stick
    error, number : estimated error of the goal, relative (see `relative_error`), and its name
    seconds : of this round, estimate included
    """

    size_mm: float
    base_size_mm: float
    dofs: int
    error: float
    number: str
    seconds: float
    gauge_refinement: float = 1.0
    stick_refinement: float = 1.0

    def line(self, count: int) -> str:
        """Return the round as one line of text."""
        places = (self.gauge_refinement, "the gauge"), (self.stick_refinement, "the border of stick")
        finer = "".join(f"{self.size_mm / factor:.4g} mm at {where}, " for factor, where in places if factor > 1.0)
        return (
            f"round {count}: size {self.size_mm:.4g} mm, {finer}base {self.base_size_mm:.4g} mm, {self.dofs} dofs, "
            f"error {100 * self.error:.2g} % ({self.number}), {self.seconds:.1f} s"
        )


@dataclass(frozen=True)
class Refinement:
    """Result of a mesh refinement.

    Attributes
    ----------
    mesh : edge lengths of the best round
    problem : condensed on that mesh, if it is that of the last round; the others are not kept in memory
    stopped : why it ended: the tolerance is met, or the time, the memory, the rounds are used up
    """

    tolerance: float
    mesh: MeshOptions
    rounds: tuple[Round, ...]
    stopped: str
    problem: Problem | None = field(default=None, repr=False, compare=False)

    @property
    def best(self) -> Round:
        """The round with the fewest unknowns that meets the tolerance, else that with the smallest error."""
        return best_round(self.rounds, self.tolerance)

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


def best_round(rounds: Sequence[Round], tolerance: float) -> Round:
    """Return the round with the fewest unknowns that meets a tolerance; without one, that with the smallest error."""
    met = [r for r in rounds if r.error <= tolerance]
    return min(met, key=lambda r: r.dofs) if met else min(rounds, key=lambda r: r.error)


def refine_mesh(
    model: Model,
    tolerance: float,
    max_seconds: float | None = None,
    report: Progress = QUIET,
    goal: str = GOAL,
) -> Refinement:
    """Refine the mesh of a model until the estimated error of the goal is below a tolerance.

    Parameters
    ----------
    model : with the edge lengths of the first round
    tolerance : relative, see `relative_error`
    max_seconds : no round is begun that is forecast to end later, output included
    report : receives the messages
    goal : name of a number of the press, as in `finger3d.accuracy.estimate.press_numbers`, or "all": in every round
        that with the largest relative error; for the normal force under a prescribed one, the depth takes its place

    Raises
    ------
    Finger3dError
        If even the first mesh cannot be generated or pressed.
    """
    if model.ends_at_force and goal == GOAL:  # the force is given, and the depth follows
        goal = "depth_mm"
    start, rounds, meshes = time.perf_counter(), list[Round](), list[MeshOptions]()
    options, problem = model.mesh, None
    run = _graded_round if applies(model) else _run_round
    stopped = f"{MAX_ROUNDS} rounds"
    while len(rounds) < MAX_ROUNDS:
        problem = None  # two factors at once would halve the mesh that memory allows
        try:
            problem, done, wanted = run(replace(model, mesh=options), tolerance, goal)
        except UnresolvedError as error:
            if rounds and rounds[-1].error <= tolerance:
                break
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
        meshes.append(options)
        report.say(done.line(len(rounds)))
        coarsest = done.error <= tolerance and (
            done.error > _COARSEN * tolerance
            or any(r.error > tolerance for r in rounds)
            or wanted == options
            or (len(rounds) > 1 and done.dofs > _WORTHWHILE * rounds[-2].dofs)
        )
        if coarsest or (done.error > tolerance and any(r.error <= tolerance for r in rounds)):
            break
        left = math.inf if max_seconds is None else max_seconds - (time.perf_counter() - start)
        if wanted.grading is None:
            found = _affordable(options, wanted, done.seconds, left, 3 if model.domain == "solid" else 2)
        else:
            found = wanted if _graded_seconds(problem, wanted, done.seconds) <= left else None
        if found is None:
            stopped = f"max_seconds = {max_seconds:g}"
            break
        options = found
    best = best_round(rounds, tolerance)
    stopped = "met" if best.error <= tolerance else stopped
    kept = meshes[rounds.index(best)]
    return Refinement(tolerance, kept, tuple(rounds), stopped, problem if best is rounds[-1] else None)


def _relative_errors(
    numbers: Mapping[str, float], kinds: Mapping[str, Kind], errors: Mapping[str, float], goal: str
) -> dict[str, float]:
    """Return the relative errors of the goal, or of all numbers, the largest first."""
    names = [name for name in errors if name in numbers] if goal == ALL else [goal]
    found = {name: relative_error(numbers, kinds, name, errors[name]) for name in names}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _graded_round(model: Model, tolerance: float, goal: str) -> tuple[Problem, Round, MeshOptions]:
    """Press on one mesh; return its problem, its round, and the mesh graded towards the goal to try next."""
    start = time.perf_counter()
    problem = with_refined_borders(model)
    short, steps = short_press(problem)
    steps[-1].check("the press on this mesh")
    try:
        bars = adjoint_bars(short, steps)
    except NoAdjointBarsError:
        return _run_round(model, tolerance, goal)
    numbers = press_numbers(short, steps[-1])
    errors = _relative_errors(numbers, bars.kinds, bars.bars, goal)
    worst, error = next(iter(errors.items()))
    wanted = []
    for name, its_error in errors.items():
        if name not in bars.parts:  # of a zone, whose border alone counts
            wanted.append(_at_borders(problem, name, bars.kinds[name], its_error, tolerance, numbers))
        elif name == worst or its_error > _COARSEN * tolerance:
            allowed = _SAFETY * tolerance * bars.bars[name] / its_error if its_error > 0.0 else 0.0
            wanted.append(graded_sizes(short, bars, name, allowed) if allowed > 0.0 else model.mesh)
    dofs = int(problem.body.stiffness.upper.shape[0])
    seconds = time.perf_counter() - start
    return problem, _round(model.mesh, dofs, error, worst, seconds), finest(wanted)


def _run_round(model: Model, tolerance: float, goal: str) -> tuple[Problem, Round, MeshOptions]:
    """Press on one mesh; return its problem, its round, and the edge lengths to try next."""
    start = time.perf_counter()
    problem = build(model)
    step = last_step(problem)
    numbers = press_numbers(problem, step)
    other = companion(problem)
    last = last_step(other)
    kinds = kinds_of(step.readings)
    errors = _relative_errors(numbers, kinds, compared(problem, step, other, last, press_numbers), goal)
    goal, error = next(iter(errors.items()))
    # a finer companion changes both lengths, so that their effects cannot be separated
    coarse = press_numbers(other, last) if other.model.mesh.base_size_mm >= model.mesh.base_size_mm else None
    sizes = _next_sizes(problem, (goal, kinds[goal]), error, tolerance, numbers, coarse)
    seconds = time.perf_counter() - start
    dofs = int(problem.body.stiffness.upper.shape[0])
    return problem, _round(model.mesh, dofs, error, goal, seconds), sizes


def _round(mesh: MeshOptions, dofs: int, error: float, goal: str, seconds: float) -> Round:
    """Return the record of a round on a mesh."""
    return Round(
        mesh.size_mm, mesh.base_size_mm, dofs, error, goal, seconds, mesh.gauge_refinement, mesh.stick_refinement
    )


def _next_sizes(
    problem: Problem,
    goal: tuple[str, Kind],
    error: float,
    tolerance: float,
    fine: Mapping[str, float],
    coarse: Mapping[str, float] | None,
) -> MeshOptions:
    """Return smaller edge lengths of contact, base or both by the error of the goal, or longer ones of both."""
    options = problem.model.mesh
    if error <= tolerance:
        return _longer(problem, fine["contact_half_length_mm"])
    number, kind = goal
    is_zone = kind.is_length or kind is Kind.AREA
    shares = (1.0, 0.0) if is_zone else _error_shares(problem, number, fine, coarse)
    power = 1.0 if is_zone else ORDERS.get(kind, ORDER)
    factor = min(max((_SAFETY * tolerance / error) ** (1.0 / power), _FACTOR_RANGE[0]), _FACTOR_RANGE[1])
    size = options.size_mm * (factor if shares[0] >= _MIN_SHARE else 1.0)
    base = options.base_size_mm * (factor if shares[1] >= _MIN_SHARE else 1.0)
    return replace(options, size_mm=four_digits(size), base_size_mm=four_digits(max(size, base)))


def _at_borders(
    problem: Problem, goal: str, kind: Kind, error: float, tolerance: float, numbers: Mapping[str, float]
) -> MeshOptions:
    """Return shorter edges at the border of stick, or at the whole contact, for the length or area of a zone."""
    own = problem.model.mesh
    if error <= tolerance or not goal.startswith("stick") or own.stick_refinement >= MOST_STICK_REFINEMENT:
        return replace(_next_sizes(problem, (goal, kind), error, tolerance, numbers, None), borders=None)
    least, most = _AT_STICK
    finer = own.stick_refinement * min(max(error / (_SAFETY * tolerance), least), most)
    return replace(own, stick_refinement=four_digits(min(finer, MOST_STICK_REFINEMENT)), borders=None)


def _longer(problem: Problem, contact_half_length_mm: float) -> MeshOptions:
    """Return twice the edge lengths, as far as contact stays resolved and the body is two edges thick."""
    own, design = problem.model.mesh, problem.model.design
    most = 0.5 * min(design.height_mm, 2.0 * design.half_length_mm)
    width = 0.25 * design.width_mm if problem.dim == 3 else math.inf
    size = max(own.size_mm, min(2.0 * own.size_mm, contact_half_length_mm / _FEWEST_POINTS, most, width))
    return replace(
        own, size_mm=four_digits(size), base_size_mm=four_digits(max(size, min(2.0 * own.base_size_mm, most)))
    )


def _error_shares(
    problem: Problem, number: str, fine: Mapping[str, float], coarse: Mapping[str, float] | None
) -> tuple[float, float]:
    """Return the shares of the difference to the companion that the edge lengths of contact and base cause."""
    options = problem.model.mesh
    size = min(FACTOR * options.size_mm, options.base_size_mm)
    if coarse is None or size < 1.1 * options.size_mm:
        return 1.0, 1.0
    third = build(replace(problem.model, mesh=replace(_with_swept_mesher(problem, options), size_mm=size)))
    middle = press_numbers(third, last_step(third))[number]
    contact, base = abs(fine[number] - middle), abs(middle - coarse[number])
    total = contact + base
    return (contact / total, base / total) if total > 0.0 else (1.0, 0.0)


def _with_swept_mesher(problem: Problem, options: MeshOptions) -> MeshOptions:
    return replace(options, mesher="swept") if problem.model.design.section() is not None else options


def _affordable(now: MeshOptions, wanted: MeshOptions, seconds: float, left: float, dim: int) -> MeshOptions | None:
    """Return the wanted edge lengths, or longer ones if time is short; None if no refinement is affordable."""
    left /= PRESS_TO_ROUND
    factor = min(wanted.size_mm / now.size_mm, wanted.base_size_mm / now.base_size_mm)
    power = dim * GROWTH[dim]
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
    return replace(now, size_mm=four_digits(size), base_size_mm=four_digits(max(size, base)))


def _graded_seconds(problem: Problem, wanted: MeshOptions, seconds: float) -> float:
    """Return the forecast seconds of a press on a graded mesh, from those of a round on the mesh that it follows."""
    at_contact = (problem.model.mesh.size_mm / wanted.size_mm) ** (problem.dim - 1)
    growth = max(cell_growth(problem, wanted), at_contact)
    return float(PRESS_TO_ROUND * seconds * growth ** GROWTH[problem.dim])
