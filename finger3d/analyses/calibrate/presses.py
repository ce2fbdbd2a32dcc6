"""Presses of one condensed body under one coefficient of friction after another, each started from those before.

Where mu changes by 0.1 at most, forces at the mu before take up to half off the time of a press, whose increments
then need no other start.  They decide nothing: what is found is proved as always.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Event

from finger3d._types import Float
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.parallel import map_parallel
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.solve import march

_FARTHEST = 2.0  # times the distance of the last two mu: forces are not continued beyond
_NEAR = 0.1  # of mu: from one farther off a press takes longer than from its own path


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


Like = Mapping[float, Press]
"""Presses of a body much like another, by mu."""


def press(
    problem: Problem,
    mu: float,
    near: Sequence[Press] = (),
    workspace: Workspace | None = None,
    cancel: Event | None = None,
) -> Press:
    """Press the condensed body with this mu, started from the last two presses of `near`."""
    law, forces, frame = problem.model.friction.with_mu(mu), [], None
    start = _start(problem, mu, near)
    workspace = workspace or problem.model.formulation.workspace()
    before = workspace.factorizations
    for frame in march(replace(problem, model=replace(problem.model, friction=law)), start, workspace, cancel):
        forces.append(frame.part.force)
    assert frame is not None  # a path has an increment
    return Press(mu, frame, tuple(forces), workspace.factorizations - before)


def presses(problem: Problem, mus: Sequence[float], like: Like | None = None) -> Iterator[Press]:
    """Presses with ascending mu; where `like` has a press with the same mu, that is what it starts from."""
    known = like or {}

    def pressed(mu: float, before: Sequence[Press], workspace: Workspace, cancel: Event) -> Press:
        return press(problem, mu, [known[mu]] if mu in known else before, workspace, cancel)

    return map_parallel(problem, pressed, mus)


def _start(problem: Problem, mu: float, near: Sequence[Press]) -> list[Float]:
    """Forces of the last press near, continued at the pace of the two; none of a body with other points."""
    shape = problem.delassus.shape[:2]
    good = [p for p in near if p.forces[0].shape == shape]
    if not good or abs(good[-1].mu - mu) > _NEAR:
        return []
    first, last = good[0], good[-1]
    if first.mu == last.mu:
        return list(last.forces)
    share = min((mu - last.mu) / (last.mu - first.mu), _FARTHEST)
    return [b + share * (b - a) for a, b in zip(first.forces, last.forces, strict=False)]
