"""The press: contact solved increment by increment along the path of the object."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from threading import Event
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.rules import STEP_DEPENDENT_RULES
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.mechanics.columns import Column, in_order, strain_columns
from finger3d.mechanics.energy import external_work, frictional_dissipation
from finger3d.mechanics.force_control import deepest, depth_of_force
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.path import prescribed_forces, targets
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.state import State
from finger3d.objects import Move, ObjectPose

_CUTS = 6
"""Times that an increment which does not converge is halved, at most."""


@dataclass(frozen=True)
class _Substep:
    """A converged part of an increment: states before and after, and the motion of the object."""

    before: State[Any]
    after: State[Any]
    move: Move


def march(
    problem: Problem,
    near: Sequence[Float] = (),
    workspace: Workspace | None = None,
    cancel: Event | None = None,
) -> Iterator[StepResult]:
    """Yield the result of every increment of all legs; ends after the first that does not converge.

    Under a stick rule that depends on the increments, an increment that cycles is yielded as it is and never halved.

    Parameters
    ----------
    problem : Problem
    near : sequence of (c, d) arrays, N
        Contact forces at the ends of the increments of a similar press, as initial guesses.
    workspace : Workspace, optional
        What an earlier press of the same body left; empty unless given.
    cancel : Event, optional
        Once it is set, the press ends before its next increment.

    Raises
    ------
    CancelledError
        If `cancel` is set.
    """
    model = problem.model
    most_cuts = 0 if model.rule in STEP_DEPENDENT_RULES else _CUTS
    formulation = formulation_of(model)
    workspace = workspace or formulation.workspace()
    without_inclusions = _march_without_inclusions(problem, workspace)
    state, at = formulation.start(problem), problem.origin
    previous: tuple[Move, Float] | None = None
    work = dissipation = 0.0
    start_force = 0.0
    for number, (target, load) in enumerate(zip(targets(model.legs), prescribed_forces(model.legs), strict=True)):
        if cancel is not None and cancel.is_set():
            raise CancelledError
        guess = near[number] if number < len(near) else extrapolated_force(state.contact, Move(at, target), previous)
        if load is None:
            found, substeps = _increment(problem, workspace, state, Move(at, target), most_cuts, guess)
        else:
            if load[0] == 1:
                start_force = _normal_force(problem, state.contact)
            wanted = start_force + load[0] / load[1] * (load[2] - start_force)
            found, substeps, target = _to_force(
                problem, workspace, state, Move(at, target), most_cuts, (wanted, load[2]), previous
            )
        for part in substeps:
            work += external_work(problem, part.before, part.after, part.move)
            dissipation += frictional_dissipation(problem, part.before.contact, part.after.contact)
        previous = Move(at, target), state.contact.force
        state, at = found.state, target
        free_strain = _free_strain(problem, without_inclusions)
        yield StepResult(
            target=target,
            state=problem.symmetry.unfold(state.contact),
            meshed_state=state,
            lowest=problem.placed(target).lowest,
            moment=problem.symmetry.total_moment(formulation.loads(problem, state, target).moment),
            readings=in_order(formulation.readings(problem, state) | free_strain),
            external_work_mJ=work,
            dissipation_mJ=dissipation,
            outcome=found.outcome,
            residual=found.residual,
            iterations=found.iterations,
            method=found.method,
            penetration_mm=max(-float(state.contact.gap.min(initial=0.0)), 0.0),
            detail=found.detail,
        )
        if not (found.outcome.ok or found.outcome.is_cycle):
            return


def _march_without_inclusions(problem: Problem, workspace: Workspace) -> Iterator[StepResult] | None:
    """The same press of the body without inclusions, for the free strain of the gauges."""
    body = problem.without_inclusions
    return march(replace(body, model=problem.model), workspace=workspace) if body else None


def _free_strain(problem: Problem, without_inclusions: Iterator[StepResult] | None) -> dict[Column, float]:
    """Strain of every gauge in the body without inclusions; NaN once its press has failed."""
    if without_inclusions is None:
        return {}
    step = next(without_inclusions, None)
    known = step is not None and (step.outcome.ok or step.outcome.is_cycle)
    columns = [strain_columns(gauge.name) for gauge in problem.model.gauges]
    return {free: step.readings[own] if step and known else np.nan for own, free in columns}


def _normal_force(problem: Problem, state: ContactState) -> float:
    return -float(problem.world_force(state)[:, 1].sum())


def _to_force(
    problem: Problem,
    workspace: Workspace,
    state: State[Any],
    move: Move,
    cuts: int,
    load: tuple[float, float],
    previous: tuple[Move, Float] | None,
) -> tuple[ContactSolution[State[Any]], list[_Substep], ObjectPose]:
    """Advance to the depth where the normal force is `load[0]`, N; the leg ends at `load[1]`."""

    def pose(depth: float) -> ObjectPose:
        return replace(move.end, depth_mm=depth)

    def force_at(depth: float) -> float:
        found, _ = _increment(problem, workspace, state, Move(move.start, pose(depth)), cuts)
        if not found.outcome.ok:
            raise _FailedError
        return _normal_force(problem, found.state.contact)

    most = deepest(problem.model.object, problem.system.first_contact_mm, problem.model.design.height_mm)
    start_mm = move.start.depth_mm
    guess = start_mm + (start_mm - previous[0].start.depth_mm if previous else move.end.depth_mm)
    try:
        target = pose(depth_of_force(force_at, load[0], start_mm, guess, most, load[1]))
    except _FailedError:
        target = move.end
    found, substeps = _increment(problem, workspace, state, Move(move.start, target), cuts)
    return found, substeps, target


class _FailedError(Exception):
    """An increment at a trial depth did not converge."""


def extrapolated_force(state: ContactState, move: Move, previous: tuple[Move, Float] | None) -> Float | None:
    """Return the forces extrapolated linearly, if the path continues in the direction of the previous increment.

    `previous` is the motion in that increment, and the forces (c, d) N at its start.
    """
    if previous is None:
        return None
    before, force = previous
    ratio = move.length_ratio(before)
    return None if ratio is None else state.force + ratio * (state.force - force)


def _increment(
    problem: Problem,
    workspace: Workspace,
    state: State[Any],
    move: Move,
    cuts: int,
    guess: Float | None = None,
) -> tuple[ContactSolution[State[Any]], list[_Substep]]:
    """Advance a state; an increment that does not converge is halved and repeated from the same state."""
    found = formulation_of(problem.model).increment(problem, state, move, guess, workspace)
    if found.outcome.ok or cuts == 0:
        return found, [_Substep(state, found.state, move)]
    middle = move.at(0.5)
    first, done = _increment(problem, workspace, state, Move(move.start, middle), cuts - 1)
    if not first.outcome.ok:
        return replace(first, state=state, iterations=first.iterations + found.iterations), done
    second, more = _increment(problem, workspace, first.state, Move(middle, move.end), cuts - 1)
    return replace(
        second,
        residual=max(first.residual, second.residual),
        iterations=found.iterations + first.iterations + second.iterations,
        method="cut back",
    ), done + more
