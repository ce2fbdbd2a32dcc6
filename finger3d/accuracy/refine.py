"""Mesh refinement until the estimated error of one number, the goal, is below a tolerance.

What limits the area of stick in a solid is the distance of the contact points at its border, not the cells of the body.
The cells that the border crosses are bisected, once for every factor of two of `mesh.stick_refinement`, each time from
the press on the mesh before.

A first mesh whose error is far below the tolerance is made coarser instead, as long as the tolerance is met.  Otherwise
the edges of one zone of the mesh become shorter: those at the contact, at the base and in the body, at gauges, or at
the border of stick.  It is the zone that leaves the largest error in the goal, by presses in which the edges of one
zone at a time are twice as long or, at the base, half as long.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from finger3d._cost import GROWTH, PRESS_TO_ROUND
from finger3d._ranges import four_digits
from finger3d._types import Float, Tree
from finger3d.accuracy.error_bars import gain, relative_error
from finger3d.accuracy.estimate import discretisation, press_numbers
from finger3d.contact.friction import SLIP, STICK
from finger3d.errors import Finger3dError, UnresolvedError
from finger3d.fem.mesh import axis_numbers
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import rough_steps, with_few_increments
from finger3d.mechanics.model import MeshOptions, Model
from finger3d.mechanics.readings import Kind, kinds_of
from finger3d.meshing.sizing import SizedPlaces
from finger3d.progress import QUIET, Progress

MOST_STICK_REFINEMENT = 16.0
"""Largest `mesh.stick_refinement`."""

_REACH = 0.6
"""Distance from the border up to which edges are shortest, over the length of the edges that it crosses."""

_RATE = 1.0
"""Growth of the edge length per distance beyond."""


def with_refined_borders(model: Model, report: Progress = QUIET) -> Problem:
    """Return the body on a mesh with edges of ``mesh.size_mm / mesh.stick_refinement`` at the border of stick.

    The coarser meshes that find the border have no shorter edges around gauges.  If nothing slips on one of them, or if
    its press does not converge, the mesh stays as coarse at the contact.

    Raises
    ------
    Finger3dError
        If the refined mesh is estimated to need too much memory.
    """
    options, factor, borders = model.mesh, 1.0, None
    while factor < options.stick_refinement:
        coarse = build(replace(model, mesh=replace(options, gauge_refinement=1.0, borders=borders)), report)
        short = with_few_increments(coarse)
        steps = list(march(short))
        places = stick_borders(short, _ends_of_legs(short, steps)) if steps[-1].outcome.ok else np.zeros((0, 3))
        if not len(places) and options.gauge_refinement == 1.0:
            return coarse
        if not len(places):
            break
        edge = options.size_mm / factor
        factor = min(2.0 * factor, options.stick_refinement)
        report.say(f"border of stick: edges of {options.size_mm / factor:.3g} mm")
        borders = SizedPlaces(places, options.size_mm / factor, _RATE, _REACH * edge)
    return build(replace(model, mesh=replace(options, borders=borders)), report)


def _ends_of_legs(problem: Problem, steps: Sequence[StepResult]) -> list[StepResult]:
    """Return the last increments of the legs, between which the border moves."""
    counts = [leg.steps if isinstance(leg.steps, int) else 1 for leg in problem.model.legs]
    return [steps[end - 1] for end in np.cumsum(counts) if end <= len(steps)]


def stick_borders(problem: Problem, steps: Sequence[StepResult]) -> Float:
    """Return the middles (k, d) mm of edges between points that stick and slip, mirrored into the meshed part."""
    points, middles = problem.points, [np.zeros((0, 3))]
    for step in steps:
        ends = step.state.status[points.edges]
        border = (ends == STICK).any(axis=1) & (ends == SLIP).any(axis=1)
        middles.append(points.points[points.edges[border]].mean(axis=1))
    places = np.vstack(middles)
    for axis in axis_numbers(problem.axes):
        places[:, axis] = np.abs(places[:, axis])
    return np.unique(np.round(places[:, : problem.dim], 9), axis=0)


MAX_ROUNDS = 12
GOAL, ALL = "normal_force_N", "all"
"""Number that a mesh is refined for unless a scene names another, and the name of all numbers together."""

_FACTOR_RANGE = (0.4, 0.85)  # a round changes an edge length at least and at most by these factors
_COARSEN = 0.25
"""Error over the tolerance from which a mesh is not made coarser: the next would hardly have fewer unknowns."""

_WORTHWHILE = 0.7
"""Unknowns of a coarser mesh over those of the one before, above which no coarser one is tried."""

_FEWEST_POINTS = 8
"""Contact points that the half-length of contact keeps on a coarser mesh."""

_MOST_GAUGE_REFINEMENT = 16.0
"""Largest edge length at the contact over that around a gauge."""

_FINER = 2.0
"""Ratio of the edges of a zone that are tried, and the least one at gauges and borders, where cells are bisected."""

_FASTEST = 2.0
"""Order with which an error falls at most from round to round: a bar that is small by chance shall not end them."""

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
        met = [r for r in self.rounds if r.error <= self.tolerance]
        return min(met, key=lambda r: r.dofs) if met else min(self.rounds, key=lambda r: r.error)

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
        rounds = [asdict(r) for r in self.rounds]
        return {"tolerance": self.tolerance, "met": self.met, "stopped": self.stopped, "rounds": rounds}


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
    stopped, grading = f"{MAX_ROUNDS} rounds", options.base_size_mm / options.size_mm
    while len(rounds) < MAX_ROUNDS:
        problem = None  # two factors at once would halve the mesh that memory allows
        try:
            before = rounds[-1] if rounds else None
            problem, done, wanted = _run_round(replace(model, mesh=options), tolerance, goal, before)
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
        if done.error > tolerance:  # edges that grow faster than those of the companions hide errors from them
            wanted = replace(wanted, base_size_mm=min(wanted.base_size_mm, four_digits(grading * wanted.size_mm)))
        left = math.inf if max_seconds is None else max_seconds - (time.perf_counter() - start)
        found = _affordable(options, wanted, done.seconds, left, 3 if model.domain == "solid" else 2)
        if found is None:
            stopped = f"max_seconds = {max_seconds:g}"
            break
        options = found
    refined = Refinement(tolerance, options, tuple(rounds), stopped)
    mesh, last = meshes[rounds.index(refined.best)], problem if refined.best is rounds[-1] else None
    return replace(refined, mesh=mesh, stopped="met" if refined.met else stopped, problem=last)


def _run_round(model: Model, tolerance: float, goal: str, before: Round | None) -> tuple[Problem, Round, MeshOptions]:
    """Press on the mesh after that of the round before; return its problem, round, and the edge lengths to try next."""
    start = time.perf_counter()
    problem = with_refined_borders(model)
    short = with_few_increments(problem)
    steps = list(march(short))
    steps[-1].check("the press on this mesh")
    numbers, kinds = press_numbers(short, steps[-1]), kinds_of(steps[-1].readings)
    found, *_ = discretisation(short, steps, numbers=press_numbers)
    names = [name for name in found.discretisation if name in numbers] if goal == ALL else [goal]
    errors = {name: relative_error(numbers, kinds, name, found.discretisation[name]) for name in names}
    worst, mesh = max(errors, key=lambda name: errors[name]), model.mesh
    error = errors[worst]
    if before and before.number == worst:
        fall = min(new / old for new, old in zip(_edges(mesh), _edges(before), strict=True)) ** _FASTEST
        error = max(error, min(1.0, fall) * before.error)
    if error <= tolerance:
        wanted = _longer(problem, numbers["contact_half_length_mm"])
    else:
        factor = (_SAFETY * tolerance / error) ** (1.0 / (1.0 if kinds[worst].is_zone else kinds[worst].order))
        factor = min(max(factor, _FACTOR_RANGE[0]), _FACTOR_RANGE[1])
        wanted = _shorter(mesh, _zone_to_refine(short.model, numbers[worst], worst, kinds[worst]), factor)
    edges = {key: getattr(mesh, key) for key in ("size_mm", "base_size_mm", "gauge_refinement", "stick_refinement")}
    dofs, seconds = int(problem.body.stiffness.upper.shape[0]), time.perf_counter() - start
    return problem, Round(**edges, dofs=dofs, error=error, number=worst, seconds=seconds), wanted


def _edges(mesh: MeshOptions | Round) -> tuple[float, ...]:
    """Return the edge lengths (mm) of the zones of a mesh."""
    size = mesh.size_mm
    return size, mesh.base_size_mm, size / mesh.gauge_refinement, size / mesh.stick_refinement


def _zone_to_refine(model: Model, value: float, goal: str, kind: Kind) -> str:
    """Return the zone of a mesh whose edges leave the largest error in the goal, which has a value on it.

    Edges at gauges and at the border of stick are tried beside longer ones at the contact, which alone keep theirs.
    """
    mesh, size = model.mesh, _FINER * model.mesh.size_mm
    gauges, border = mesh.gauge_refinement, mesh.stick_refinement
    coarse = _of_sizes(mesh, size, max(size, mesh.base_size_mm))
    at_contact = replace(coarse, gauge_refinement=_FINER * gauges, stick_refinement=_FINER * border)
    beside = _goal_on(model, at_contact, goal)
    errors = {"contact": (beside - value) / gain(_FINER)}
    if not kind.is_zone and mesh.base_size_mm > mesh.size_mm:
        errors["base"] = (_goal_on(model, _shorter(mesh, "base", 1.0 / _FINER), goal) - value) / gain(1.0 / _FINER)
    if kind is Kind.STRAIN and gauges < _MOST_GAUGE_REFINEMENT:
        errors["gauges"] = (_goal_on(model, replace(at_contact, gauge_refinement=gauges), goal) - beside) / gain(_FINER)
    if kind.is_stick and border < MOST_STICK_REFINEMENT:
        errors["border"] = (_goal_on(model, replace(at_contact, stick_refinement=border), goal) - beside) / gain(_FINER)
    return max(errors, key=lambda zone: math.inf if math.isnan(errors[zone]) else abs(errors[zone]))


def _goal_on(model: Model, mesh: MeshOptions, goal: str) -> float:
    """Return the goal in a rough press on another mesh, nan if it cannot be made or does not converge."""
    try:
        problem = with_refined_borders(replace(model, mesh=mesh))
        return press_numbers(problem, rough_steps(problem)[-1])[goal]
    except (Finger3dError, MemoryError):
        return math.nan


def _shorter(mesh: MeshOptions, zone: str, factor: float) -> MeshOptions:
    """Return the edge lengths with those of one zone times a factor below 1; all others are kept."""
    at_contact = factor if zone == "contact" else 1.0
    size = mesh.size_mm * at_contact
    base = max(size, mesh.base_size_mm * (factor if zone == "base" else 1.0))

    def finer(where: str, ratio: float, most: float) -> float:  # edges there are given over those at the contact
        there = min(factor, 1.0 / _FINER) if zone == where else 1.0
        return four_digits(min(max(1.0, ratio * at_contact / there), most))

    gauges = finer("gauges", mesh.gauge_refinement, _MOST_GAUGE_REFINEMENT)
    border = finer("border", mesh.stick_refinement, MOST_STICK_REFINEMENT)
    return replace(_of_sizes(mesh, size, base), gauge_refinement=gauges, stick_refinement=border)


def _of_sizes(mesh: MeshOptions, size: float, base: float) -> MeshOptions:
    """Return a mesh with other edge lengths, mm, without the borders that were found on it."""
    return replace(mesh, size_mm=four_digits(size), base_size_mm=four_digits(base), borders=None)


def _longer(problem: Problem, contact_half_length_mm: float) -> MeshOptions:
    """Return twice the edge lengths, as far as contact stays resolved and the body is two edges thick."""
    own, design = problem.model.mesh, problem.model.design
    most = 0.5 * min(design.height_mm, 2.0 * design.half_length_mm)
    width = 0.25 * design.width_mm if problem.dim == 3 else math.inf
    size = max(own.size_mm, min(2.0 * own.size_mm, contact_half_length_mm / _FEWEST_POINTS, most, width))
    return _of_sizes(own, size, max(size, min(2.0 * own.base_size_mm, most)))


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
    size = now.size_mm * (wanted.size_mm / now.size_mm) ** part
    base = now.base_size_mm * (wanted.base_size_mm / now.base_size_mm) ** part
    return replace(now, size_mm=four_digits(size), base_size_mm=four_digits(max(size, base)))
