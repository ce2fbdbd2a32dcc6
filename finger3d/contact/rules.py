"""Stick rules: algorithms that determine which points are open, stick or slip; a scene chooses one."""

from __future__ import annotations

from typing import Final, Literal, Protocol

from finger3d._types import Float
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.maeno import maeno_active_set
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactSolution, ContactState


class StickRule(Protocol):
    """Solution of one increment."""

    def __call__(self, problem: ContactProblem, guess: Float | None = None) -> ContactSolution[ContactState]:
        """Solve one increment, from an initial guess (c, d) N of the forces if there is one."""
        ...


RuleName = Literal["projection", "paper"]

RULES: Final[dict[RuleName, StickRule]] = {"projection": solve_increment, "paper": maeno_active_set}

STEP_DEPENDENT_RULES: Final[frozenset[RuleName]] = frozenset({"paper"})
"""Rules whose increments are never cut and may end in a cycle, so that the result depends on the increments."""
