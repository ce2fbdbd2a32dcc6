"""Presses at finite strain that differ in friction, path, materials, object or dimensions, and share tangents.

A group solves every increment with all of its presses before the next.  Presses that converge slowly with the
tangent of the group's middle press stop before that increment, and continue from there in a later group.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from threading import Event
from typing import Any

from finger3d.contact.state import ContactSolution
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.finite_strain.body import FiniteStrainWorkspace
from finger3d.mechanics.finite_strain.formulation import Beginning, increments
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import State, StepResult
from finger3d.mechanics.march.solve import Press
from finger3d.mechanics.path import stations
from finger3d.objects import Move


def march_in_groups(
    problems: Sequence[Problem], workspace: Workspace, cancel: Event
) -> Iterator[tuple[int, list[StepResult]]]:
    """Press several problems with the same unknowns and contact points, those in order that are most alike.

    Parameters
    ----------
    problems : their paths have as many increments
    workspace : of the body that most of them share

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


class _Presses:
    """Presses that have been begun."""

    def __init__(self, problems: Sequence[Problem], workspace: Workspace, cancel: Event) -> None:
        assert isinstance(workspace, FiniteStrainWorkspace)
        middle = problems[len(problems) // 2].condensed_body
        self.running = {
            n: Press(problem, workspace if problem.condensed_body is middle else workspace.beside(), cancel)
            for n, problem in enumerate(problems)
        }
        self.steps: dict[int, list[StepResult]] = {n: [] for n in self.running}
        self._stations = [stations(problem.model.legs) for problem in problems]
        self._cancel = cancel

    def advanced(self) -> list[int]:
        """Finish the presses that share the tangents of the middle one; return the numbers of all that have ended."""
        ended: list[int] = []
        behind = min(len(self.steps[number]) for number in self.running)
        members = [number for number in self.running if len(self.steps[number]) == behind]
        leader = members[len(members) // 2]
        while leader in self.running:
            increment = len(self.steps[leader])
            group = [number for number in self.running if len(self.steps[number]) == increment]
            together = self._solved_together(group, leader, increment)
            for number in group:
                if together is None or number == leader or number in together:
                    self._advance(number, together.get(number, ()) if together else ())
                    ended += [number] * (number not in self.running)
        return ended

    def _advance(self, number: int, solutions: Sequence[ContactSolution[State[Any]]]) -> None:
        """Take the next increment of a press; one that has ended is not running any more."""
        press, own = self.running[number], self._stations[number]
        self.steps[number].append(press.advance(own[len(self.steps[number])], solutions=solutions))
        if press.has_failed or len(self.steps[number]) == len(own):
            del self.running[number]

    def _solved_together(
        self, group: list[int], leader: int, increment: int
    ) -> dict[int, list[ContactSolution[State[Any]]]] | None:
        """Return the solutions found together, by their numbers; None if each press is to be solved by itself."""
        if len(group) < 2 or self._cancel.is_set() or any(self._stations[n][increment].load for n in group):
            return None
        moves = {n: self.running[n].moves_to(self._stations[n][increment].pose) for n in group}
        found: dict[int, list[ContactSolution[State[Any]]]] = {
            n: [] for n in group if len(moves[n]) == len(moves[leader])
        }
        for _ in moves[leader]:
            solutions = increments([self._beginning(n, moves[n], found[n]) for n in found], list(found).index(leader))
            converged = [(number, one) for number, one in zip(found, solutions, strict=True) if one is not None]
            found = {number: [*found[number], one] for number, one in converged}
            if leader not in found:
                return {}
        return found

    def _beginning(
        self, number: int, moves: Sequence[Move], before: Sequence[ContactSolution[State[Any]]]
    ) -> Beginning:
        """Return the next part of an increment of a press, after those that are solved."""
        press = self.running[number]
        state = before[-1].state if before else press.state
        guess = None if before else press.expected_force(moves[-1].end)
        return Beginning(press.formulation, press.problem, state, guess, moves[len(before)], press.workspace)  # type: ignore[arg-type]
