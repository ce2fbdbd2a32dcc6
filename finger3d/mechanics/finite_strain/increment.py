"""One increment of contact at finite strain: Newton's method for equilibrium around the contact solution.

Iterations reuse the tangent of an earlier configuration, also one of an earlier increment or press, while they converge
(chord method, Ortega and Rheinboldt 1970, sec. 7.1); secants accelerate them (Anderson 1965).  Where they do not
converge from afar, the path of equilibrium is followed roughly, from which the iteration begins nearer (continuation,
Allgower and Georg 1990).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from finger3d._types import Float
from finger3d.contact.acceleration import one_thread
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.rules import ForceCondition, solve_to_force
from finger3d.contact.state import SNAPPED, ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.recovery.recover import displacement
from finger3d.fem.tensors import InvertedError
from finger3d.mechanics.finite_strain.equations import NEW_TANGENT, Configuration, IncrementEquations
from finger3d.mechanics.finite_strain.failure import cause_of_failure
from finger3d.mechanics.finite_strain.state import DeformedBody, Linearisation
from finger3d.mechanics.results.state import State
from finger3d.objects import Move

_ITERATIONS, _FACTORS, _PATIENT_FACTORS = 60, 5, 15
"""Largest number of iterations and of new factors before an iteration is given up, and of those where the path cannot
be followed, or the body may snap: steps that go down in energy may lead to the equilibrium all the same."""

_SHORTEST = 0.125
"""Shortest part, over the increment, in which the path is followed."""

_SECANTS = 5
"""Largest number of secants: 3 to 8 need as many iterations."""

_NEAR = 1e-4
"""Residual below which an iteration that is not patient goes on as long as a patient one does."""

_ASTRAY, _DIVERGED = 0.1, 1.0
"""Residuals above which an iteration starts again with a new tangent, and with a new tangent is given up.  From the
first on it is given up too if a step with a new tangent is too long: the tangent is nearly singular there."""

_EXACT = 1e-10
"""Relative error of a prescribed force at which the contact of the linearised body is solved."""

_DAMPED_FACTORS = 40
"""Largest number of damped iterations; twice as many where the body may snap."""

_SNAPS = 0.02
"""Motion of the object, over the depth, up to which an increment without equilibrium nearby may end at another one, to
which the body snaps.  Longer increments are halved instead, so that the path is followed to where it ends."""

_STALLS, _FALLS = 6, 0.9
"""Damped iterations in a row after which an increment too long to snap is given up, so that it is halved, if the
residual has not fallen to this share of its least value."""

_SNAP_RISES = 5
"""Damped iterations in a row in which the residual rises as the body leaves one equilibrium for another."""

_LARGEST_RISE = 3.0
"""Largest ratio of successive residuals of damped iterations; beyond it the damping grows instead."""

_FADING = 0.6
"""Factor of the damping, besides the ratio of residuals, where the residual falls."""

_FIRST_DAMPING, _MORE_DAMPING, _LEAST_DAMPING = 1.0, 4.0, 1e-4
"""Linear stiffness added to the tangent at first, factor by which it grows where an iteration fails (and its largest
change and value), and share below which none is added.  With a factor of 10 the snap of one press in twelve did not
settle."""

_Secants = list[tuple[Float, Float]]


@dataclass(frozen=True)
class FiniteIncrement(IncrementEquations):
    """An increment solved by itself."""

    def solve(self, guess: Float | None) -> ContactSolution[State[DeformedBody]]:
        """Iterate until equilibrium and the contact conditions hold; the state is without internal variables.

        An iteration has too little work for two threads: the press of Fig. 9 takes a tenth longer on them.
        """
        with one_thread():
            return self._solved_in_steps(guess)

    def _solved_in_steps(self, guess: Float | None) -> ContactSolution[State[DeformedBody]]:
        patiently, spent = partial(self._iterate, patient=True), 0
        for attempt in (patiently,) if self._may_snap else (self._followed, patiently):
            _, solution = attempt(guess)
            spent += solution.iterations
            if solution.outcome.ok or solution.detail:
                return replace(solution, iterations=spent)
        damped = self._iterate_damped()
        detail = damped.detail
        if damped.outcome is Outcome.NEWTON:
            detail = cause_of_failure(self.problem, displacement(self.problem.mesh, self.start.body.unknowns))
        return replace(damped, iterations=spent + damped.iterations, detail=detail)

    def _followed(self, guess: Float | None) -> tuple[Self, ContactSolution[State[DeformedBody]]]:
        """Iterate to the end of the increment; where that does not converge, roughly to a point halfway to it first.

        The solution is that of the whole increment, as the points serve to extrapolate from only.  The increment that
        is returned has the motion that was found, if that is unknown.
        """
        rough, spent = self.workspace.rough(), 0
        begin = np.append(self.start.body.unknowns, self.move.start.depth_mm)
        points, shares = [(0.0, begin)], [1.0]
        while shares:
            last, share = points[-1][0], shares[-1]
            there = _extrapolated(points[-2:], share) if len(points) > 1 else None
            part = self._part(share, self.move.at(share).depth_mm if there is None else float(there[-1]))
            part = part if share == 1.0 else replace(part, workspace=rough)
            part, solution = part._iterate(guess, None if there is None else there[:-1])
            spent += solution.iterations
            if solution.outcome.ok:
                points.append((shares.pop(), np.append(solution.state.body.unknowns, part.move.end.depth_mm)))
                guess = solution.state.contact.force
            elif solution.detail or share - last <= _SHORTEST:
                break
            else:
                shares.append(0.5 * (last + share))
                guess = None if there is None else guess
        self.workspace.factorizations += rough.factorizations
        return part, replace(solution, iterations=spent)

    @property
    def _may_snap(self) -> bool:
        return self.motion <= _SNAPS * self.length_scale

    def _part(self, share: float, depth: float) -> Self:
        """Return the increment up to a share of it, where a depth (mm) is expected."""
        return self if share == 1.0 else replace(self, move=self.move.cut(share)[0])

    def _iterate(
        self, guess: Float | None, expected: Float | None = None, patient: bool = False
    ) -> tuple[Self, ContactSolution[State[DeformedBody]]]:
        """Iterate from expected unknowns (N,), else from those extrapolated, with a new tangent where that is slow.

        A patient iteration shortens steps that are too long, and goes on.  One that does not converge with the tangent
        of an earlier increment starts again with a new one.
        """
        now, force = self.initial(guess, expected)
        first = increment, now, force, unbalanced = self, now, force, self.out_of_balance(now, force)
        is_new = now.x is self.start.body.unknowns and not force.any()  # the last tangent is of another configuration
        linearisation, factors, spent, errors = None if is_new else self.last_linearisation(), 0, 0, [math.inf]
        secants = _Secants()
        for _ in range(_ITERATIONS):
            if linearisation is None:
                if factors >= (_PATIENT_FACTORS if patient or errors[-1] < _NEAR else _FACTORS):
                    break
                linearisation = increment.linearise(now, force, local=factors % 2 == 1)
                factors, secants = factors + 1, _Secants()
            is_astray = errors[-1] > _ASTRAY
            longest = increment._largest_step if factors and is_astray and not patient else math.inf
            accelerating = None if is_astray else secants
            solution, after = increment._advance(now, (force, unbalanced), linearisation, longest, accelerating)
            spent += solution.iterations
            if after is None:
                if factors:
                    break
                linearisation, (increment, now, force, unbalanced), errors = None, first, [math.inf]
                continue
            (increment, now, unbalanced), force = after, solution.state.force
            errors.append(increment._error(now, solution.state, unbalanced))
            if self.has_converged(errors[-1], errors[-2]):
                return increment, increment.finished(now, solution, errors[-1], spent)
            if factors and errors[-1] > _DIVERGED:
                break
            if self.remaining(errors) > self.factor_cost + NEW_TANGENT:
                linearisation = None
                if not factors and errors[-1] > _ASTRAY:
                    (increment, now, force, unbalanced), errors = first, [math.inf]
        return increment, increment.failed(now, Outcome.NEWTON, errors[-1], spent)

    def _iterate_damped(self) -> ContactSolution[State[DeformedBody]]:
        """Iterate from the first state with a multiple of the linear stiffness added to the tangent.

        The multiple decreases with the residual to zero (pseudo-transient continuation, Kelley and Keyes 1998).  Beyond
        a limit point of the path a constant multiple follows the snap down in energy.
        """
        now, force = self.at(self.start.body.unknowns), self.start.contact.force
        unbalanced = self.out_of_balance(now, force)
        damping, spent, error = _FIRST_DAMPING, 0, math.inf
        may_snap, rises, snapped = self._may_snap, 0, False
        least, stalls = math.inf, 0
        for _ in range(2 * _DAMPED_FACTORS if may_snap else _DAMPED_FACTORS):
            tangent = self.linearise(now, force, damping)
            solution, after = self._advance(now, (force, unbalanced), tangent, math.inf, None)
            spent += solution.iterations
            next_error = math.inf if after is None else self._error(after[1], solution.state, after[2])
            stalls = 0 if next_error < _FALLS * least else stalls + 1
            least = min(least, next_error)
            if stalls == _STALLS and not may_snap:
                break
            if after is None or next_error > _LARGEST_RISE * error:
                damping = max(damping, _LEAST_DAMPING) * _MORE_DAMPING
                continue
            (_, now, unbalanced), force = after, solution.state.force
            last_error, error = error, next_error
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

    def _to_depth(self, depth: float) -> Self:
        """Return the increment with another depth (mm) at its end."""
        return replace(self, move=Move(self.move.start, replace(self.move.end, depth_mm=depth)))

    def _error(self, now: Configuration, state: ContactState, unbalanced: Float) -> float:
        return self.residual(now, state, unbalanced)

    def _turning(self, linearisation: Linearisation) -> Sequence[Float]:
        """Return loads (N,) N/mm by which nodal contact forces change with the depth, if that is unknown."""
        return ()

    def _advance(
        self,
        now: Configuration,
        forces: tuple[Float, Float],
        linearisation: Linearisation,
        longest: float,
        secants: _Secants | None,
    ) -> tuple[ContactSolution[ContactState], tuple[Self, Configuration, Float] | None]:
        """Return the contact solution, the next configuration, accelerated by secants, and what is out of balance.

        The forces are those of contact (c, d) and what they leave out of balance (N,).  There is no next configuration
        if contact has no solution, a cell inverts, or a node moves further than the longest step, mm.
        """
        force, unbalanced = forces
        loads = [-unbalanced, *self._turning(linearisation)]
        eliminated = linearisation.condensation.eliminated(np.column_stack(loads))
        increment, solution, change = self.contact(
            now, force, linearisation, *eliminated.displacement[linearisation.reads].T
        )
        by = [1.0, increment.move.end.depth_mm - self.move.end.depth_mm][: len(loads)]
        step = eliminated.unknowns(np.outer(change, np.eye(len(loads))[0])) @ by
        length = float(np.abs(step[: self.problem.mesh.points.size]).max())
        if not solution.outcome.ok or not np.isfinite(step).all() or length > longest:
            return solution, None
        if secants is not None:
            depth = increment.move.end.depth_mm
            reached = np.concatenate([now.x + step, solution.state.force.ravel(), [depth]])
            secants[:] = [*secants[-_SECANTS:], (reached, step)]
            end = _accelerated(secants)
            step, force = end[: len(step)] - now.x, end[len(step) : -1].reshape(force.shape)
            solution = replace(solution, state=replace(solution.state, force=force))
            increment = increment if end[-1] == depth else increment._to_depth(float(end[-1]))
        try:
            return solution, (increment, *increment.moved(now, step, solution.state.force))
        except InvertedError:
            return solution, None


def _accelerated(iterations: _Secants) -> Float:
    """Return the next z (m,) of a fixed-point iteration z -> g(z), accelerated by secants (Anderson 1965).

    It is the combination of g(z) in the last iterations, with weights of sum 1, that has the shortest step.

    Parameters
    ----------
    iterations : g(z) (m,) of each, and its step (k,), g(z) - z or as much of it as is to be short
    """
    ends, steps = (np.array(one) for one in zip(*iterations, strict=True))
    weights = np.linalg.lstsq(np.diff(steps, axis=0).T, steps[-1])[0]
    return np.asarray(ends[-1] - weights @ np.diff(ends, axis=0))


def _extrapolated(points: Sequence[tuple[float, Float]], share: float) -> Float:
    """Return the place (k,) at a share of a path, on the line through two points at other shares."""
    (s0, x0), (s1, x1) = points
    return np.asarray(x1 + (share - s1) / (s1 - s0) * (x1 - x0))


@dataclass(frozen=True)
class IncrementToForce(FiniteIncrement):
    """An increment to a prescribed normal force, with the depth at its end as one more unknown of the iteration.

    In every iteration the object moves further down by the distance at which the contact forces f of the linearised
    body add up to the force F ::

        contact conditions of f and of the gaps and slips with the object lowered,    sum of f_y = F

    Attributes
    ----------
    wanted : F on the whole finger, N
    rate : of the force by the depth in the last iteration, N/mm
    """

    wanted: float
    rate: float = math.nan

    def solve_to_force(self, guess: Float | None) -> tuple[Move, ContactSolution[State[DeformedBody]]]:
        """Return the motion to the depth that is found near the expected one, and the solution at its end.

        The state of the solution is without internal variables.
        """
        increment, solution = self._part(1.0, self.move.end.depth_mm)._followed(guess)
        return increment.move, solution

    def _part(self, share: float, depth: float) -> Self:
        """Return the increment up to a share of the root of the force, with which the depth of contact grows."""
        before = -float(self.problem.world_force(self.start.contact)[:, 1].sum())
        wanted = (share * math.sqrt(self.wanted) + (1.0 - share) * math.sqrt(max(before, 0.0))) ** 2
        pose = self.move.end if share == 1.0 else self.move.at(share)
        start = self.move.start
        rise, way = wanted - before, depth - start.depth_mm
        rate = rise / way if rise * way > 0.0 else self.wanted / self.length_scale
        move = Move(start, replace(pose, depth_mm=depth))
        return replace(self, move=move, wanted=wanted, rate=rate)

    def _error(self, now: Configuration, state: ContactState, unbalanced: Float) -> float:
        return max(super()._error(now, state, unbalanced), abs(self._force(now, state.force) / self.wanted - 1.0))

    def _force(self, now: Configuration, force: Float) -> float:
        """Return the normal force (N) on the whole finger of contact forces (c, d) in the present directions."""
        state = replace(self.start.contact, force=force, bases=now.contact.bases)
        return -float(self.problem.world_force(state)[:, 1].sum())

    def _turning(self, linearisation: Linearisation) -> Sequence[Float]:
        return () if linearisation.turning is None else (linearisation.turning,)

    def _solved(
        self, now: Configuration, force: Float, contact: ContactProblem, turned: Float | float
    ) -> tuple[Self, ContactSolution[ContactState]]:
        """Lower the object until the linearised body has the force, by at most the largest step."""
        depth, images, far = self.move.end.depth_mm, 2.0 ** len(self.problem.axes), self._largest_step
        condition = ForceCondition(
            down=self.active(now.contact.bases[:, :, 1].ravel()),
            force=self.wanted / images,
            rate=self.rate / images,
            reach=(-far, far),
            tolerance=_EXACT,
            turned=turned,
        )
        solution, lowered, rate = solve_to_force(self.problem.model.rule, contact, force, condition)
        if not solution.outcome.ok:
            return self, solution
        return replace(self._to_depth(depth + lowered), rate=images * rate), solution
