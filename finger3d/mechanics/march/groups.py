"""Presses of one body at finite strain with several friction laws, in groups that share tangents.

A group solves every increment with all of its presses before the next.  Presses that converge slowly with the
tangent of the group's middle press stop before that increment, and continue from there in a later group.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from threading import Event
from typing import Any

from finger3d.contact.state import ContactSolution
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.finite_strain.formulation import FiniteStrain
from finger3d.mechanics.finite_strain.state import FiniteStrainWorkspace
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.march.path import Station, stations
from finger3d.mechanics.march.solve import Press
from finger3d.mechanics.results.history import StepResult
from finger3d.mechanics.results.state import State


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


class _Presses:
    """Presses that have been begun."""

    def __init__(self, problems: Sequence[Problem], workspace: Workspace, cancel: Event) -> None:
        self.running = {n: Press(problem, workspace, cancel) for n, problem in enumerate(problems)}
        self.steps: dict[int, list[StepResult]] = {n: [] for n in self.running}
        self._stations = stations(problems[0].model.legs)
        self._workspace, self._cancel = workspace, cancel

    def advanced(self) -> list[int]:
        """Finish the presses that share the tangents of the middle one; return the numbers of all that have ended."""
        ended: list[int] = []
        behind = min(len(self.steps[number]) for number in self.running)
        members = [number for number in self.running if len(self.steps[number]) == behind]
        leader = members[len(members) // 2]
        while leader in self.running:
            increment = len(self.steps[leader])
            group = [number for number in self.running if len(self.steps[number]) == increment]
            together = self._solved_together(group, leader, self._stations[increment])
            for number in group:
                if together is None or number == leader or number in together:
                    self._advance(number, self._stations[increment], together.get(number, ()) if together else ())
                    ended += [number] * (number not in self.running)
        return ended

    def _advance(self, number: int, station: Station, solutions: Sequence[ContactSolution[State[Any]]]) -> None:
        """Take the next increment of a press; one that has ended is not running any more."""
        press = self.running[number]
        self.steps[number].append(press.advance(station, solutions=solutions))
        if press.has_failed or len(self.steps[number]) == len(self._stations):
            del self.running[number]

    def _solved_together(
        self, group: list[int], leader: int, station: Station
    ) -> dict[int, list[ContactSolution[State[Any]]]] | None:
        """Return the solutions found together, by their numbers; None if each press is to be solved by itself."""
        presses = [self.running[number] for number in group]
        formulation = presses[0].formulation
        if len(group) < 2 or self._cancel.is_set() or station.load or not isinstance(formulation, FiniteStrain):
            return None
        assert isinstance(self._workspace, FiniteStrainWorkspace)
        starts = {n: (press.state, press.expected_force(station.pose)) for n, press in zip(group, presses, strict=True)}
        found: dict[int, list[ContactSolution[State[Any]]]] = {number: [] for number in group}
        for move in presses[0].moves_to(station.pose):
            solutions = formulation.increments(
                [self.running[number].problem for number in found],
                [starts[number] for number in found],
                move,
                self._workspace,
                list(found).index(leader),
            )
            converged = [(number, one) for number, one in zip(found, solutions, strict=True) if one is not None]
            found = {number: [*found[number], one] for number, one in converged}
            starts = {number: (one.state, None) for number, one in converged}
            if leader not in found:
                return {}
        return found
