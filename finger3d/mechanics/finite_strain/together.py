"""One increment of several presses at finite strain, which share factors and solve for all right-hand sides at once.

The presses iterate in step by the chord method: one elimination and one substitution of many right-hand sides cost a
fraction of those of one after another, and the rest of an iteration runs on all cores.  A new tangent is that of the
middle press among those whose residuals fall slowly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from finger3d._machine import cores
from finger3d._types import Float
from finger3d.contact.acceleration import one_thread
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.fem.tensors import InvertedError
from finger3d.mechanics.finite_strain.equations import NEW_TANGENT, Configuration, IncrementEquations
from finger3d.mechanics.finite_strain.state import DeformedBody, Linearisation
from finger3d.mechanics.results.state import State

T = TypeVar("T")

_ITERATIONS, _FACTORS = 40, 10
"""Largest number of iterations and of new factors in an increment."""

_ASTRAY, _DIVERGED = 0.1, 1.0
"""Residuals above which an iteration starts again with a new tangent, and with a new tangent is given up."""

_TOO_SLOW = 15
"""Remaining iterations above which a press should wait for a tangent nearer to its own."""


@dataclass
class _Trial:
    """Iteration of one press.

    Attributes
    ----------
    number : of the press
    first : configuration and contact forces (c, d) where it begins
    is_new : whether the tangent has been factored since
    slow : number of iterations after which more than `_TOO_SLOW` remained, with a tangent that served the leader
    """

    number: int
    equations: IncrementEquations
    first: tuple[Configuration, Float]
    now: Configuration = field(init=False)
    force: Float = field(init=False)
    out_of_balance: Float = field(init=False)
    error: float = math.inf
    last_error: float = math.inf
    spent: int = 0
    is_new: bool = False
    slow: int = 0
    solution: ContactSolution[ContactState] | None = None

    def __post_init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Go back to where the iteration began."""
        (self.now, self.force), self.error = self.first, math.inf
        self.out_of_balance = self.equations.out_of_balance(self.now, self.force)

    def contact(self, linearisation: Linearisation, displacement: Float) -> Float | None:
        """Solve contact; returns the changes (r,) of the forces on the rows, None if there is no solution."""
        _, self.solution, change = self.equations.contact(self.now, self.force, linearisation, displacement)
        self.spent += self.solution.iterations
        return change if self.solution.outcome.ok else None

    def move(self, step: Float) -> bool:
        """Take a step (N,); returns False if a cell would be inverted."""
        assert self.solution is not None
        if not np.isfinite(step).all():
            return False
        try:
            self.now, self.out_of_balance = self.equations.moved(self.now, step, self.solution.state.force)
        except InvertedError:
            return False
        self.force, self.last_error = self.solution.state.force, self.error
        self.error = self.equations.residual(self.now, self.solution.state, self.out_of_balance)
        return True

    @property
    def has_converged(self) -> bool:
        """Whether the iteration has ended."""
        return self.equations.has_converged(self.error, self.last_error)

    def lags(self) -> bool:
        """Count the iteration if more than `_TOO_SLOW` remain; return whether two have been counted."""
        self.slow += self.remaining > _TOO_SLOW
        return self.slow > 1

    @property
    def remaining(self) -> float:
        """Number of iterations until convergence, if the residual falls as it did."""
        return self.equations.remaining([self.last_error, self.error])


def solve_together(
    increments: Sequence[IncrementEquations], guesses: Sequence[Float | None], leader: int
) -> list[ContactSolution[State[DeformedBody]] | None]:
    """Solve an increment of several presses of one body, whose workspace they share.

    Parameters
    ----------
    leader : number of the press whose tangents are factored

    Returns
    -------
    Solution of each press, None where the iteration does not converge, or would converge faster with another tangent.
    """
    solutions: list[ContactSolution[State[DeformedBody]] | None] = [None] * len(increments)
    trials = [
        _Trial(n, increment, increment.initial(guess))
        for n, (increment, guess) in enumerate(zip(increments, guesses, strict=True))
    ]
    first, active, linearisation = trials[leader], trials, increments[0].last_linearisation()
    factors = 0
    with ThreadPoolExecutor(min(cores(), len(trials))) as pool:
        for _ in range(_ITERATIONS):
            if not active:
                break
            if linearisation is None:
                if factors == _FACTORS:
                    break
                linearisation, factors = first.equations.linearise(first.now, first.force), factors + 1
                for trial in active:
                    trial.is_new = True
            active = _advanced(active, linearisation, pool)
            for trial in active:
                if trial.has_converged:
                    assert trial.solution is not None
                    one = trial.equations.finished(trial.now, trial.solution, trial.error, trial.spent)
                    solutions[trial.number] = one if one.outcome.ok else None
            active = [trial for trial in active if not trial.has_converged]
            ahead = sum(max(trial.remaining - NEW_TANGENT, 0.0) for trial in active)
            if first in active and (first.remaining > _TOO_SLOW if factors else ahead > first.equations.factor_cost):
                linearisation = None
                for trial in active:
                    if not trial.is_new and trial.error > _ASTRAY:
                        trial.begin()
            elif factors or first not in active:
                active = [trial for trial in active if trial is first or not trial.lags()]
    return solutions


def _advanced(trials: list[_Trial], linearisation: Linearisation, pool: ThreadPoolExecutor) -> list[_Trial]:
    """Advance all trials by an iteration; returns those that may converge."""
    eliminated = linearisation.condensation.eliminated(-np.column_stack([trial.out_of_balance for trial in trials]))
    read = eliminated.displacement[linearisation.reads]
    changes = _mapped(pool, lambda trial, moved: trial.contact(linearisation, moved), trials, read.T)
    none = np.zeros(len(read))
    steps = eliminated.unknowns(np.column_stack([none if change is None else change for change in changes]))

    def moved(trial: _Trial, step: Float, change: Float | None) -> bool:
        if change is not None and trial.move(step):
            return not trial.is_new or trial.error <= _DIVERGED
        trial.begin()
        return not trial.is_new

    kept = _mapped(pool, moved, trials, steps.T, changes)
    return [trial for trial, is_kept in zip(trials, kept, strict=True) if is_kept]


def _mapped(pool: ThreadPoolExecutor, function: Callable[..., T], *arguments: Iterable[object]) -> list[T]:
    with one_thread():
        return list(pool.map(function, *arguments))
