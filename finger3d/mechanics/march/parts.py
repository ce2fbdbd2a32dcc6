"""Converged parts of an increment, their energies, and the state that a trial of an increment expects at its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from finger3d.contact.state import ContactSolution
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.energy import external_work, frictional_dissipation
from finger3d.mechanics.results.state import State
from finger3d.objects import Move, ObjectPose


@dataclass(frozen=True)
class Substep:
    """A converged part of an increment: states before and after, and the motion of the object."""

    before: State[Any]
    after: State[Any]
    move: Move


@dataclass(frozen=True)
class Advanced:
    """End of an increment: its solution, the converged parts, and the pose that was reached.

    `energies` are the work of the object and the dissipation (mJ) if they are known, else they follow from the parts.
    """

    solution: ContactSolution[State[Any]]
    parts: list[Substep]
    pose: ObjectPose
    energies: tuple[float, float] | None = None


def energies(problem: Problem, parts: Sequence[Substep]) -> tuple[float, float]:
    """Return the work of the object and the dissipation (mJ) in converged parts."""
    work = sum(external_work(problem, part.before, part.after, part.move) for part in parts)
    lost = sum(frictional_dissipation(problem, part.before.contact, part.after.contact) for part in parts)
    return work, lost


def expecting(state: State[Any], move: Move, ends: tuple[State[Any], State[Any]], share: float) -> State[Any]:
    """Return a state at finite strain from which the increment begins its iteration at an expected end.

    The end has the unknowns ``ends[0] + share (ends[0] - ends[1])``.
    """
    one, other = (end.body.unknowns for end in ends)
    end = one + share * (one - other)
    before = Move(move.at(-1.0), move.start), 2.0 * state.body.unknowns - end
    return replace(state, body=replace(state.body, previous=before))
