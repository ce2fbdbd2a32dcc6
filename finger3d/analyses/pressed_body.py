"""Presses of a condensed body with several coefficients of friction, each started from the presses before it.

Where mu changes by at most 0.1, the forces at the previous mu save up to half of the time of a press.  They are an
initial guess only: the solution satisfies the contact conditions in any case.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Event

from finger3d._types import Float
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.groups import march_in_groups
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.parallel import map_parallel
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.solve import march

_FARTHEST = 2.0
"""Largest extrapolation of forces in mu, over the difference of the last two values."""

_NEAR = 0.1
"""Largest difference in mu from which a press is started; from farther off its own path is the better start."""


@dataclass(frozen=True)
class Press:
    """A press with one mu.

    Attributes
    ----------
    mu : coefficient of friction
    frame : the last increment
    forces : contact forces (c, d), N, on the meshed part at the end of every increment
    factorizations : factorisations of the body in the increments
    """

    mu: float
    frame: StepResult
    forces: tuple[Float, ...]
    factorizations: int = 0


PressesByMu = Mapping[float, Press]
"""Presses by mu, as initial guesses for those of a similar body or path."""


def press(
    problem: Problem,
    mu: float,
    near: Sequence[Press] = (),
    workspace: Workspace | None = None,
    cancel: Event | None = None,
) -> Press:
    """Press the condensed body with this mu; the last two presses of `near` give the initial guess."""
    law, forces, frame = problem.model.friction.with_mu(mu), [], None
    start = _start(problem, mu, near)
    workspace = workspace or formulation_of(problem.model).workspace()
    before = workspace.factorizations
    for frame in march(replace(problem, model=replace(problem.model, friction=law)), start, workspace, cancel):
        forces.append(frame.meshed_state.contact.force)
    assert frame is not None  # a path has an increment
    return Press(mu, frame, tuple(forces), workspace.factorizations - before)


def presses(problem: Problem, mus: Sequence[float], initial: PressesByMu | None = None) -> Iterator[Press]:
    """Yield a press for each of ascending values of mu, started from the press of `initial` with the same mu if any.

    At finite strain they come in another order than that of mu; see `march_in_groups`.
    """
    if problem.model.finite_strain:
        yield from _together(problem, mus)
        return
    known = initial or {}

    def pressed(mu: float, before: Sequence[Press], workspace: Workspace, cancel: Event) -> Press:
        return press(problem, mu, [known[mu]] if mu in known else before, workspace, cancel)

    yield from map_parallel(problem, pressed, mus)


def _together(problem: Problem, mus: Sequence[float]) -> Iterator[Press]:
    """Yield the presses with all values of mu, which share factors."""
    workspace, model, counted = formulation_of(problem.model).workspace(), problem.model, 0
    problems = [replace(problem, model=replace(model, friction=model.friction.with_mu(mu))) for mu in mus]
    for number, steps in march_in_groups(problems, workspace, Event()):
        new, counted = workspace.factorizations - counted, workspace.factorizations
        yield Press(mus[number], steps[-1], tuple(step.meshed_state.contact.force for step in steps), new)


def _start(problem: Problem, mu: float, near: Sequence[Press]) -> list[Float]:
    """Return the forces extrapolated in mu from the last two presses; none if these have other contact points."""
    shape = problem.delassus.shape[:2]
    good = [p for p in near if p.forces[0].shape == shape]
    if not good or abs(good[-1].mu - mu) > _NEAR:
        return []
    first, last = good[0], good[-1]
    if first.mu == last.mu:
        return list(last.forces)
    share = min((mu - last.mu) / (last.mu - first.mu), _FARTHEST)
    return [b + share * (b - a) for a, b in zip(first.forces, last.forces, strict=False)]
