"""Presses of one body at finite strain with several friction laws, in groups that share tangents.

A group solves every increment with all of its presses before the next.  Presses that converge slowly with the
tangent of the group's middle press stop before that increment, and continue from there in a later group.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from threading import Event
from typing import Any

from finger3d._types import Float
from finger3d.contact.state import ContactSolution
from finger3d.mechanics.finite_state import DeformedBody
from finger3d.mechanics.finite_strain import FiniteStrain
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.path import prescribed_forces, targets
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.solve import extrapolated_force, march
from finger3d.mechanics.state import State
from finger3d.objects import Move


def march_in_groups(
    problems: Sequence[Problem], workspace: Workspace, cancel: Event
) -> Iterator[tuple[int, list[StepResult]]]:
    """Press one body along one path with several friction laws, in the order of their coefficients.

    Yields
    ------
    Number of the problem, and the results of its increments, group by group.

    Raises
    ------
    CancelledError
        If `cancel` is set.
    """
    presses = _Presses(problems, workspace, cancel)
    while presses.running:
        for number in presses.advanced():
            yield number, presses.steps[number]


@dataclass
class _Presses:
    """Presses that have been begun."""

    problems: Sequence[Problem]
    workspace: Workspace
    cancel: Event

    def __post_init__(self) -> None:
        self.running = {n: march(problem, (), self.workspace, self.cancel) for n, problem in enumerate(self.problems)}
        self.steps: dict[int, list[StepResult]] = {n: [] for n in self.running}
        legs = self.problems[0].model.legs
        self._poses = [self.problems[0].origin, *targets(legs)]
        self._loads = prescribed_forces(legs)

    def advanced(self) -> list[int]:
        """Finish the presses that share the tangents of the middle one; return the numbers of all that have ended."""
        ended: list[int] = []
        behind = min(len(self.steps[number]) for number in self.running)
        members = [number for number in self.running if len(self.steps[number]) == behind]
        leader = members[len(members) // 2]
        while leader in self.running:
            increment = len(self.steps[leader])
            group = [number for number in self.running if len(self.steps[number]) == increment]
            known = self._known(group, leader, increment)
            for number in group:
                if known is None or number == leader or number in known:
                    ended += self._next(number, None if known is None else known.get(number))
        return ended

    def _next(self, number: int, known: ContactSolution[State[Any]] | None) -> list[int]:
        """Take the next increment of a press; returns its number if the press has ended."""
        self.workspace.known = known
        step = next(self.running[number], None)
        self.workspace.known = None
        if step is None:
            del self.running[number]
            return [number]
        self.steps[number].append(step)
        return []

    def _known(
        self, group: list[int], leader: int, increment: int
    ) -> dict[int, ContactSolution[State[DeformedBody]]] | None:
        """Return the solutions found together, by their numbers; None if each press is to be solved by itself."""
        formulation = formulation_of(self.problems[0].model)
        if len(group) < 2 or self.cancel.is_set() or increment == len(self._loads):
            return None
        if self._loads[increment] is not None or not isinstance(formulation, FiniteStrain):
            return None
        found = formulation.increments(
            [self.problems[number] for number in group],
            [self._start(number, increment) for number in group],
            Move(*self._poses[increment : increment + 2]),
            self.workspace,  # type: ignore[arg-type]
            group.index(leader),
        )
        return {number: one for number, one in zip(group, found, strict=True) if one is not None}

    @cached_property
    def _rest(self) -> State[Any]:
        return formulation_of(self.problems[0].model).start(self.problems[0])

    def _start(self, number: int, increment: int) -> tuple[State[Any], Float | None]:
        """Return the state at the start of an increment, and the contact forces expected at its end."""
        states = [self._rest, *(step.meshed_state for step in self.steps[number])]
        if not increment:
            return states[0], None
        before, start, end = self._poses[increment - 1 : increment + 2]
        last, now = states[-2].contact, states[-1].contact
        return states[-1], extrapolated_force(now, Move(start, end), (Move(before, start), last.force))
