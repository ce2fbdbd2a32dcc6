"""Increments in parts, which are cut where they do not converge, their energies, and the state expected at the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import SLIP
from finger3d.contact.state import SNAPPED, ContactSolution, ContactState
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import State
from finger3d.mechanics.small_strain import transported
from finger3d.objects import Move, ObjectPose

FIRST_PARTS = 1.0 / 16.0, 0.25
"""Shares at which an increment that begins without contact is cut: of its depth, quarters and halves of the contact's
length under a ball, or of its force, the same under a cylinder.  In the first part points move freely until one of them
touches, which says nothing of how they move later."""


@dataclass(frozen=True)
class Substep:
    """A converged part of an increment: states before and after, the motion of the object, and the residual."""

    before: State[Any]
    after: State[Any]
    move: Move
    residual: float = 0.0


@dataclass(frozen=True)
class Advanced:
    """End of an increment: its solution, the converged parts, and the pose that was reached."""

    solution: ContactSolution[State[Any]]
    parts: list[Substep]
    pose: ObjectPose


def solved_in_turn(
    problem: Problem,
    workspace: Workspace,
    state: State[Any],
    moves: Sequence[Move],
    cuts: int,
    guess: Float | None = None,
    near: Sequence[Substep] = (),
) -> tuple[ContactSolution[State[Any]], list[Substep]]:
    """Solve the parts of an increment one after another; the guess (c, d), N, of the forces is that of the last.

    A part that does not converge is halved and repeated from the same state, at most `cuts` times.  If as many parts of
    a similar increment at finite strain are given, `near`, each begins its iteration at the end expected from its like.
    """
    found, parts, now = list[ContactSolution[State[Any]]](), list[Substep](), state
    for number, move in enumerate(moves):
        start = guess if move is moves[-1] else None
        if len(near) == len(moves):
            one, other = near[number].after, near[number].before
            share = (move.length_ratio(near[number].move) or 1.0) - 1.0
            now = expecting(now, move, (one, other), share)
            start = one.contact.force + share * (one.contact.force - other.contact.force)
        end, more = _solved(problem, workspace, now, move, cuts, start)
        found, parts, now = [*found, end], parts + more, end.state
        if not end.outcome.ok:
            now = end.state if end.outcome.is_cycle else state
            break
    return combined(found, now), parts


def combined(solutions: Sequence[ContactSolution[State[Any]]], state: State[Any]) -> ContactSolution[State[Any]]:
    """Return the solution of an increment, which ends at a state, from those of its parts."""
    return replace(
        solutions[-1],
        state=state,
        residual=max(one.residual for one in solutions),
        iterations=sum(one.iterations for one in solutions),
        method=SNAPPED if any(one.method == SNAPPED for one in solutions) else solutions[-1].method,
    )


def _solved(
    problem: Problem, workspace: Workspace, state: State[Any], move: Move, cuts: int, guess: Float | None
) -> tuple[ContactSolution[State[Any]], list[Substep]]:
    whole = formulation_of(problem.model).increment(problem, state, move, guess, workspace)
    if whole.outcome.ok or cuts == 0:
        return whole, [Substep(state, whole.state, move, whole.residual)]
    halves, parts = solved_in_turn(problem, workspace, state, move.cut(0.5), cuts - 1)
    method = SNAPPED if halves.method == SNAPPED else "cut back"
    return replace(halves, iterations=whole.iterations + halves.iterations, method=method), parts


def energies(problem: Problem, parts: Sequence[Substep]) -> tuple[float, float]:
    """Return the work of the object and the dissipation (mJ) in converged parts."""
    work = sum(external_work(problem, part.before, part.after, part.move) for part in parts)
    lost = sum(frictional_dissipation(problem, part.before.contact, part.after.contact) for part in parts)
    return work, lost


def external_work(problem: Problem, before: State[Any], after: State[Any], move: Move) -> float:
    """Return the work (mJ) of the object on the finger in an increment.

    It is the work of the contact forces on the body plus the frictional dissipation, by the trapezoidal rule.
    """
    start, end = transported(before.contact, after.contact.own_bases), after.contact
    friction = 0.5 * (start.force + end.force)[:, 1:]
    rubbed = np.einsum("ct,ct->c", friction, end.tangential_displacement - start.tangential_displacement)
    formulation = formulation_of(problem.model)
    on_body = formulation.loads(problem, after, move.end).work_from(formulation.loads(problem, before, move.start))
    return float(2 ** len(problem.axes) * on_body - problem.symmetry.total(rubbed))


def frictional_dissipation(problem: Problem, before: ContactState, after: ContactState) -> float:
    """Return the frictional dissipation (mJ): slip times the friction under the mean normal force; never negative.

    Direction and coefficient of friction are those at the end of the increment.
    """
    slips = after.status == SLIP
    lost = -np.sum(after.force[:, 1:] * (after.accumulated_slip - before.accumulated_slip), axis=1) * slips
    end = after.force[:, 0]
    ratio = np.divide(0.5 * (before.force[:, 0] + end), end, out=np.ones_like(end), where=end > 0.0)
    return problem.symmetry.total(lost * ratio)


def expecting(state: State[Any], move: Move, ends: tuple[State[Any], State[Any]], share: float) -> State[Any]:
    """Return a state at finite strain from which the increment begins its iteration at an expected end.

    The end has the unknowns ``ends[0] + share (ends[0] - ends[1])``.
    """
    one, other = (end.body.unknowns for end in ends)
    end = one + share * (one - other)
    before = Move(move.at(-1.0), move.start), 2.0 * state.body.unknowns - end
    return replace(state, body=replace(state.body, previous=before))
