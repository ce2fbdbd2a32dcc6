"""The press: contact solved increment by increment along the path of the object."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import replace
from threading import Event
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.solve import STEP_DEPENDENT_RULES
from finger3d.contact.state import ContactSolution
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.generalised import GeneralisedForces, forces_on
from finger3d.mechanics.history import State, StepResult
from finger3d.mechanics.march.equilibrium import FIRST_PARTS, Advanced, Substep, ToForces, energies, solved_in_turn
from finger3d.mechanics.march.grip import Grip
from finger3d.mechanics.path import Load, Station, stations
from finger3d.mechanics.readings import Column, in_order, strain_columns
from finger3d.objects import Move, ObjectPose
from finger3d.progress import QUIET, Progress

_SIDEWAYS = np.array([0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0])  # coordinates but depth and time

CUTS = 6
"""Times that an increment which does not converge is halved, at most."""


def march(
    problem: Problem,
    workspace: Workspace | None = None,
    cancel: Event | None = None,
    report: Progress = QUIET,
    cuts: int = CUTS,
) -> Iterator[StepResult]:
    """Yield the result of every increment of all legs; ends after the first that does not converge.

    Under a stick rule that depends on the increments, an increment that cycles is yielded as it is and never halved.

    Parameters
    ----------
    problem : Problem
    workspace, cancel, report, cuts : see `Press`

    Raises
    ------
    CancelledError
        If `cancel` is set.
    """
    press = Press(problem, workspace, cancel, report, cuts)
    for station in stations(problem.model.legs):
        yield press.advance(station)
        if press.has_failed:
            return


class Press:
    """A press in progress, which advances by one increment at a time.

    Parameters
    ----------
    problem : Problem
    workspace : Workspace, optional
        What an earlier press of the same body left; empty unless given.
    cancel : Event, optional
        Once it is set, the press ends before its next increment.
    report : Progress, optional
        Receives remarks on the depth and the force of every trial while a prescribed force is searched for.
    cuts : int, optional
        Times that an increment which does not converge is halved, at most.

    Attributes
    ----------
    state, pose : after the last increment, at first before any contact
    has_failed : whether the last increment did not converge
    """

    def __init__(
        self,
        problem: Problem,
        workspace: Workspace | None = None,
        cancel: Event | None = None,
        report: Progress = QUIET,
        cuts: int = CUTS,
    ) -> None:
        model, self.formulation = problem.model, formulation_of(problem.model)
        self._grip = None if model.centre_of_mass_mm is None else Grip.of(problem)
        self.problem = problem = self._grip.problem if self._grip else problem
        self.workspace = workspace or self.formulation.workspace()
        self.state, self.pose = self.formulation.start(problem), problem.origin
        self.has_failed, self._cancel, self.workspace.report = False, cancel, report
        self._cuts = 0 if model.rule in STEP_DEPENDENT_RULES else cuts
        self._previous: tuple[Move, Float] | None = None
        self._last_part: Substep | None = None
        self._energies: Float = np.zeros((2, 2))  # work and dissipation of each finger
        self._station: Station | None = None
        self._leg_start: Float = np.zeros(7)  # forces as in a Load
        self._left: Float = np.zeros(8)  # coordinates at the start of the leg, less those of the path
        self._before: tuple[State[Any], Float] | None = None  # None if the last increment was cut
        body = problem.without_inclusions and replace(problem.without_inclusions, model=problem.model)
        self._without_inclusions = Press(body, self.workspace, report=report) if body else None

    def advance(self, station: Station, solutions: Sequence[ContactSolution[State[Any]]] = ()) -> StepResult:
        """Advance to a station, and return the result of the increment.

        Parameters
        ----------
        solutions : sequence of ContactSolution
            Solutions of the motions that `moves_to` returns, if they are known already.

        Raises
        ------
        CancelledError
            If `cancel` is set.
        """
        self._end_if_cancelled()
        move = Move(self.pose, self._pose_at(station))
        if solutions:
            states = [self.state, *(solution.state for solution in solutions)]
            moves = self.moves_to(station.pose)
            parts = [Substep(*one) for one in zip(states[:-1], states[1:], moves, strict=True)]
            end = Advanced(solutions[-1], parts, station.pose)
        elif station.load is None:
            end = self._to_pose(move.end, self.expected_force(move.end))
            if end.solution.outcome is Outcome.NEWTON and self._last_in_halves():
                end = self._to_pose(move.end, None)
        else:
            end = self._to_forces(move, station.load)
        was_cut = len(end.parts) > len(self.moves_to(end.pose))
        self._before = None if was_cut else (self.state, self._energies)
        self._add_energies(end)
        self._move_to(end)
        outcome = end.solution.outcome
        self.has_failed = not (outcome.ok or outcome.is_cycle)
        return self._result(end, self._free_strain(station))

    def _move_to(self, end: Advanced) -> None:
        self._previous = Move(self.pose, end.pose), self.state.contact.force
        self._last_part = end.parts[-1] if end.parts else None
        self.state, self.pose = end.solution.state, end.pose

    def _add_energies(self, end: Advanced) -> None:
        more = np.zeros_like(self._energies)
        for number, problem in enumerate(self._fingers):
            more[number] = energies(problem, [self._seen(number, part) for part in end.parts])
        self._energies = self._energies + more

    @property
    def _fingers(self) -> tuple[Problem, ...]:
        return self._grip.fingers if self._grip else (self.problem,)

    def _seen(self, number: int, part: Substep) -> Substep:
        """Return a part of an increment as one of the fingers has it."""
        start, before = self._at(number, part.move.start, part.before)
        end, after = self._at(number, part.move.end, part.after)
        return Substep(before, after, Move(start, end), part.residual)

    def _last_in_halves(self) -> bool:
        """Repeat the last increment in halves, and return whether they converge.

        A long increment may end at an equilibrium from which the path does not go on.
        """
        if self._before is None or self._previous is None or not self._cuts:
            return False
        (state, energies_before), whole = self._before, self._previous[0]
        found, parts = solved_in_turn(self.problem, self.workspace, state, whole.cut(0.5), self._cuts - 1)
        if not found.outcome.ok:
            return False
        self.state, self._energies = found.state, energies_before
        self._add_energies(Advanced(found, parts, whole.end))
        return True

    def expected_force(self, pose: ObjectPose) -> Float | None:
        """Return the forces (c, d) N extrapolated to a pose, if the path continues in its last direction."""
        if self._previous is None:
            return None
        before, force = self._previous
        ratio = Move(self.pose, pose).length_ratio(before)
        now = self.state.contact.force
        return None if ratio is None else now + ratio * (now - force)

    def moves_to(self, pose: ObjectPose) -> tuple[Move, ...]:
        """Return the motions in which an increment to a pose is solved: several where contact begins."""
        move = Move(self.pose, pose)
        begins = move.may_close_gaps and not self.state.contact.force.any()
        return move.cut(*FIRST_PARTS) if begins and self.problem.model.begins_in_parts else (move,)

    def _to_pose(self, pose: ObjectPose, guess: Float | None) -> Advanced:
        self._end_if_cancelled()
        moves = self.moves_to(pose)
        return Advanced(*solved_in_turn(self.problem, self.workspace, self.state, moves, self._cuts, guess), pose)

    def _end_if_cancelled(self) -> None:
        if self._cancel is not None and self._cancel.is_set():
            raise CancelledError

    def _pose_at(self, station: Station) -> ObjectPose:
        """Return the pose at a station; what forces have determined is taken back in proportion to the leg."""
        if self._station is None or self._station.share == 1.0:
            planned = self._station.pose if self._station else self.problem.origin
            self._left = _SIDEWAYS * (self.pose.coordinates - planned.coordinates)
        self._station = station
        if not self._left.any():
            return station.pose
        return station.pose.changed(np.arange(8), (1.0 - station.share) * self._left)

    def _wanted(self, load: Load) -> tuple[Float, Float]:
        """Return the forces (7,), N and N mm, now, and those prescribed at the end of the increment."""
        forces = forces_on(self.problem, self.formulation.loads(self.problem, self.state, self.pose).forces, self.pose)
        if load.begins:
            self._leg_start = forces
        return forces, self._leg_start + load.share * (load.forces - self._leg_start)

    def _to_forces(self, move: Move, load: Load) -> Advanced:
        """Advance to the pose at which the object is in equilibrium with the forces applied to it."""
        forces, wanted = self._wanted(load)
        free = np.flatnonzero(~np.isnan(wanted))
        closes = move.end.depth_mm > move.start.depth_mm
        if (wanted[0] if 0 in free else forces[0]) <= 0.0 and not closes:
            detail = "nothing touches, and a tangential force or a moment is prescribed; press first"
            ended = ContactSolution(self.state, Outcome.FORCE_NOT_REACHED, np.inf, 0, "none", detail)
            return Advanced(ended, [], move.start)
        numbers = tuple(free.tolist())
        acting = np.abs([*forces[:3], *wanted[:3], forces[6], wanted[6]])
        size = float(np.nanmax(acting)) or self._least_force(move)
        asked = float(load.forces[0]), float(np.linalg.norm(np.nan_to_num(load.forces[1:3])))
        before, after = (GeneralisedForces(numbers, values[free], size, asked) for values in (forces, wanted))
        known = self.problem, self.workspace, self.state, self._last_part
        return ToForces(*known, self.expected_force, self._cuts).run(move, before, after)

    def _least_force(self, move: Move) -> float:
        """Return the force (N) on a single point that is displaced as far as the depth changes in an increment."""
        normal = np.einsum("caca->ca", self.problem.delassus)[:, 0]
        return (move.end.depth_mm - move.start.depth_mm) / float(normal.max())

    def _free_strain(self, station: Station) -> dict[Column, float]:
        """Strain of every gauge in the body without inclusions; NaN once it has failed."""
        press = self._without_inclusions
        if press is None:
            return {}
        step = None if press.has_failed else press.advance(station)
        known = step is not None and not press.has_failed
        columns = [strain_columns(gauge.name) for gauge in self.problem.model.gauges]
        return {free: step.readings[own] if step and known else np.nan for own, free in columns}

    def _result(self, end: Advanced, free_strain: dict[Column, float]) -> StepResult:
        parts = tuple((part.move.end, part.after) for part in end.parts)
        first, *others = (
            self._result_of(number, end.solution, [self._at(number, *part) for part in parts], free_strain)
            for number in range(len(self._fingers))
        )
        return replace(first, other=others[0], pose=self.pose) if others else first

    def _at(self, number: int, pose: ObjectPose, state: State[Any]) -> tuple[ObjectPose, State[Any]]:
        """Return pose and state as one of the fingers has them."""
        return (pose, state) if self._grip is None else self._grip.seen(number, pose, state)

    def _result_of(
        self,
        number: int,
        solution: ContactSolution[State[Any]],
        parts: Sequence[tuple[ObjectPose, State[Any]]],
        free_strain: dict[Column, float],
    ) -> StepResult:
        problem, (pose, state) = self._fingers[number], self._at(number, self.pose, self.state)
        work, lost = self._energies[number].tolist()
        moment = self.formulation.loads(problem, state, pose).moment
        return StepResult(
            target=pose,
            state=problem.symmetry.unfold(state.contact),
            meshed_state=state,
            lowest=problem.placed(pose).lowest,
            moment=problem.symmetry.total_moment(moment),
            readings=in_order(self.formulation.readings(problem, state) | free_strain),
            external_work_mJ=work,
            dissipation_mJ=lost,
            outcome=solution.outcome,
            residual=solution.residual,
            iterations=solution.iterations,
            method=solution.method,
            penetration_mm=max(-float(state.contact.gap.min(initial=0.0)), 0.0),
            detail=solution.detail,
            parts=tuple(parts),
            friction=problem.model.friction,
        )
