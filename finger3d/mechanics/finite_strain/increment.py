"""One increment of contact at finite strain: Newton's method for equilibrium around the contact solution.

Iterations reuse the tangent of an earlier configuration, also one of an earlier increment or press, while they converge
(chord method, Ortega and Rheinboldt 1970, sec. 7.1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from finger3d._types import Float
from finger3d.contact.state import SNAPPED, ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.recovery.recover import displacement
from finger3d.fem.tensors import InvertedError
from finger3d.mechanics.finite_strain.equations import Configuration, IncrementEquations
from finger3d.mechanics.finite_strain.failure import cause_of_failure
from finger3d.mechanics.finite_strain.state import DeformedBody, Linearisation
from finger3d.mechanics.results.state import State

_ITERATIONS, _FACTORS = 60, 15
"""Largest number of iterations and of new factors in an increment."""

_SLOW = 0.35
"""Ratio of successive residuals above which the tangent is factored again; a factor costs about five iterations."""

_ASTRAY, _DIVERGED = 0.1, 1.0
"""Residuals above which an iteration starts again with a new tangent, and with a new tangent is given up."""

_DAMPED_FACTORS = 40
"""Largest number of damped iterations; twice as many where the body may snap."""

_SNAPS = 0.02
"""Motion of the object, over the depth, up to which an increment without equilibrium nearby may end at another one, to
which the body snaps.  Longer increments are halved instead, so that the path is followed to where it ends."""

_SNAP_RISES = 5
"""Damped iterations in a row in which the residual rises as the body leaves one equilibrium for another."""

_LARGEST_RISE = 3.0
"""Largest ratio of successive residuals of damped iterations; beyond it the damping grows instead."""

_FADING = 0.6
"""Factor of the damping, besides the ratio of residuals, where the residual falls."""

_FIRST_DAMPING, _MORE_DAMPING, _LEAST_DAMPING = 1.0, 10.0, 1e-4
"""Linear stiffness added to the tangent at first, factor by which it grows where an iteration fails (and its largest
change and value), and share below which none is added."""


@dataclass(frozen=True)
class FiniteIncrement(IncrementEquations):
    """An increment solved by itself."""

    def solve(self, guess: Float | None) -> ContactSolution[State[DeformedBody]]:
        """Iterate until equilibrium and the contact conditions hold; the state is without internal variables."""
        solution = self._iterate(guess)
        if solution.outcome.ok or solution.detail:
            return solution
        damped = self._iterate_damped()
        detail = damped.detail
        if damped.outcome is Outcome.NEWTON:
            detail = cause_of_failure(self.problem, displacement(self.problem.mesh, self.start.body.unknowns))
        return replace(damped, iterations=solution.iterations + damped.iterations, detail=detail)

    def _iterate(self, guess: Float | None) -> ContactSolution[State[DeformedBody]]:
        """Iterate from the configuration extrapolated, with a new tangent where the residual falls slowly.

        If it does not converge with the tangent of an earlier increment, the iteration starts again with a new one.
        """
        first = now, force = self.initial(guess)
        linearisation, factors, spent, error = self.last_linearisation(), 0, 0, math.inf
        for _ in range(_ITERATIONS):
            if linearisation is None:
                if factors == _FACTORS:
                    break
                linearisation, factors = self.linearise(now, force), factors + 1
            solution, after = self._advance(now, force, linearisation)
            spent += solution.iterations
            if after is None:
                if factors:
                    break
                linearisation, (now, force), error = None, first, math.inf
                continue
            now, force = after, solution.state.force
            last_error, error = error, self._error(now, solution.state)
            if self.has_converged(error, last_error):
                return self.finished(now, solution, error, spent)
            if factors and error > _DIVERGED:
                break
            if error > _SLOW * last_error:
                linearisation = None
                if not factors and error > _ASTRAY:
                    (now, force), error = first, math.inf
        return self.failed(now, Outcome.NEWTON, error, spent)

    def _iterate_damped(self) -> ContactSolution[State[DeformedBody]]:
        """Iterate from the first state with a multiple of the linear stiffness added to the tangent.

        The multiple decreases with the residual to zero (pseudo-transient continuation, Kelley and Keyes 1998).  Beyond
        a limit point of the path a constant multiple follows the snap down in energy.
        """
        now, force = self.at(self.start.body.unknowns), self.start.contact.force
        damping, spent, error = _FIRST_DAMPING, 0, math.inf
        may_snap, rises, snapped = self.motion <= _SNAPS * self.length_scale, 0, False
        for _ in range(2 * _DAMPED_FACTORS if may_snap else _DAMPED_FACTORS):
            solution, after = self._advance(now, force, self.linearise(now, force, damping))
            spent += solution.iterations
            next_error = math.inf if after is None else self._error(after, solution.state)
            if after is None or next_error > _LARGEST_RISE * error:
                damping = max(damping, _LEAST_DAMPING) * _MORE_DAMPING
                continue
            now, force, last_error, error = after, solution.state.force, error, next_error
            if self.has_converged(error, last_error):
                solution = replace(solution, method=SNAPPED) if snapped else solution
                return self.finished(now, solution, error, spent)
            change = error / last_error if math.isfinite(last_error) else 1.0
            rises = rises + 1 if change >= 1.0 else 0
            snapped |= may_snap and rises >= _SNAP_RISES
            rise = 1.0 if may_snap else min(change, 2.0)  # a damping that rises with the residual stops a snap
            damping *= max(change, 1.0 / _MORE_DAMPING) * _FADING if change < 1.0 else rise
            damping = min(damping, _MORE_DAMPING)
            damping = damping if damping > _LEAST_DAMPING else 0.0
        return self.failed(now, Outcome.NEWTON, error, spent)

    def _error(self, now: Configuration, state: ContactState) -> float:
        return self.residual(now, state, self.out_of_balance(now, state.force))

    def _advance(
        self, now: Configuration, force: Float, linearisation: Linearisation
    ) -> tuple[ContactSolution[ContactState], Configuration | None]:
        """Return the contact solution, and the next configuration; None if there is no solution, or a cell inverts."""
        eliminated = linearisation.condensation.eliminated(-self.out_of_balance(now, force))
        solution, change = self.contact(now, force, linearisation, eliminated.displacement)
        step = eliminated.unknowns(change)
        if not solution.outcome.ok or not np.isfinite(step).all():
            return solution, None
        try:
            return solution, self.moved(now, step)
        except InvertedError:
            return solution, None
