"""One increment of contact at finite strain: Newton's method for equilibrium around the contact solution.

Iterations reuse the tangent of an earlier configuration, also one of an earlier increment or press, while they converge
(chord method, Ortega and Rheinboldt 1970, sec. 7.1); secants accelerate them (Anderson 1965).  Where they do not
converge from afar, the path of equilibrium is followed roughly, from which the iteration begins nearer (continuation,
Allgower and Georg 1990).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain
from typing import Self

import numpy as np

from finger3d._types import Float
from finger3d.contact.acceleration import one_thread
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.resultants import solve_to_forces
from finger3d.contact.solve import STEP_DEPENDENT_RULES
from finger3d.contact.state import SNAPPED, ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.mesh import FREE_FACES, Mesh, most_distorted
from finger3d.fem.recovery import displacement
from finger3d.fem.tensors import InvertedError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.resolution import unresolved_details
from finger3d.mechanics.finite_strain.body import DeformedBody, Linearisation
from finger3d.mechanics.finite_strain.equations import NEW_TANGENT, Configuration, IncrementEquations
from finger3d.mechanics.generalised import GeneralisedForces, motions, resultants
from finger3d.mechanics.history import State, StepResult
from finger3d.mechanics.small_strain import accelerated
from finger3d.objects import Move, ObjectPose

_DISTORTED = 0.7
"""Ratio of volumes below which the most distorted cell is named."""

_CLOSE = 2.0
"""Distance, in lengths of the cell, at which a cell is beside a sharp edge of the finger."""


def cause_of_failure(problem: Problem, u: Float) -> str:
    """Return the probable cause and its cure in one line; empty if there is none to name.

    It is a length of the object that the contact points do not resolve, else a rule of contact without a solution, else
    the cell that is distorted most.

    Parameters
    ----------
    u : (n, d) mm, displacement of the nodes at the last converged state
    """
    if details := unresolved_details(problem.model):
        return details[0]
    if problem.model.rule in STEP_DEPENDENT_RULES:
        return "the paper's rule of contact may have no answer here; use [contact] rule = 'projection'"
    mesh = problem.mesh
    cell, ratio = most_distorted(mesh, u)
    if ratio > _DISTORTED:
        return ""
    corners = mesh.points[mesh.cells[cell, : mesh.dim + 1]]
    place = corners.mean(axis=0)
    state = f"compressed to {ratio:.2g} of its volume" if ratio > 0.0 else "folded over at a node"
    line = f"the cell at {_text(place)} mm is {state} in the increment before"
    length = float(np.ptp(corners, axis=0).max())
    edges = mesh.points[_sharp_edges(mesh)]
    if len(edges) and float(np.linalg.norm(edges - place, axis=1).min()) < _CLOSE * length:
        line += f"; it is at a sharp edge of the finger, which a fillet of {length:.2g} mm or more would round"
    return line


def fold_warnings(problem: Problem, steps: Sequence[StepResult]) -> list[str]:
    """Return a warning about the cell that is folded most at a node after any of the converged steps of a press.

    The strain at a bonded or sharp edge grows without limit, so that the displacement of a fine mesh folds over there
    while its quadrature points, on which equilibrium depends, are sound.
    """
    mesh, worst = problem.mesh, (0.0, 0, 0)
    for number, step in enumerate(steps if problem.model.finite_strain else (), 1):
        cell, ratio = most_distorted(mesh, displacement(mesh, step.meshed_state.body.unknowns))
        worst = min(worst, (ratio, cell, number))
    ratio, cell, number = worst
    if ratio == 0.0:
        return []
    place = mesh.points[mesh.cells[cell, : mesh.dim + 1]].mean(axis=0)
    return [
        f"the cell at {_text(place)} mm is folded over at a node, most in increment {number}: equilibrium holds, "
        "stress and strain at that place do not, and nothing keeps surfaces that fold over apart; a fillet or longer "
        "edges there avoid it"
    ]


def snap_warnings(steps: Sequence[StepResult]) -> list[str]:
    """Return a warning about the increments in which the body snapped to another equilibrium."""
    snapped = [str(number) for number, step in enumerate(steps, 1) if step.method == SNAPPED]
    if not snapped:
        return []
    return [
        f"the finger snaps to another equilibrium in increment {', '.join(snapped)}: the one before ends there, and "
        "the one that follows depends on mesh and increments; a fillet where a sharp edge folds, or a smaller depth, "
        "avoids it"
    ]


def _text(place: Float) -> str:
    return ", ".join(f"{axis} = {x:.3g}" for axis, x in zip("xyz", place, strict=False))


def _sharp_edges(mesh: Mesh) -> list[int]:
    """Return the vertices that belong to two faces of the finger."""
    labels = [np.unique(mesh.facets[name][:, : mesh.dim]) for name in (*FREE_FACES, "base") if name in mesh.facets]
    return [int(vertex) for vertex, count in Counter(chain.from_iterable(labels)).items() if count > 1]


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
        for attempt in (patiently,) if self._may_snap else (self.followed, patiently):
            _, solution = attempt(guess)
            spent += solution.iterations
            if solution.outcome.ok or solution.detail:
                return replace(solution, iterations=spent)
        damped = self._iterate_damped()
        detail = damped.detail
        if damped.outcome is Outcome.NEWTON:
            detail = cause_of_failure(self.problem, displacement(self.problem.mesh, self.start.body.unknowns))
        return replace(damped, iterations=spent + damped.iterations, detail=detail)

    def followed(self, guess: Float | None) -> tuple[Self, ContactSolution[State[DeformedBody]]]:
        """Iterate to the end of the increment; where that does not converge, roughly to a point halfway to it first.

        The solution is that of the whole increment, as the points serve to extrapolate from only.  The increment that
        is returned has the motion that was found, if that is unknown.
        """
        rough, spent = self.workspace.rough(), 0
        size = self.start.body.unknowns.size
        begin = np.append(self.start.body.unknowns, self._free(self.move.start))
        points, shares = [(0.0, begin)], [1.0]
        while shares:
            last, share = points[-1][0], shares[-1]
            there = _extrapolated(points[-2:], share) if len(points) > 1 else None
            part = self._part(share, self._free(self.move.at(share)) if there is None else there[size:])
            part = part if share == 1.0 else replace(part, workspace=rough)
            part, solution = part._iterate(guess, None if there is None else there[:size])
            spent += solution.iterations
            if solution.outcome.ok:
                points.append((shares.pop(), np.append(solution.state.body.unknowns, self._free(part.move.end))))
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

    def _free(self, pose: ObjectPose) -> Float:
        """Return the coordinates (k,) of a pose that are unknowns."""
        return np.zeros(0)

    def _at(self, coordinates: Float) -> Self:
        """Return the increment with other free coordinates (k,) at its end."""
        return self

    def _part(self, share: float, coordinates: Float) -> Self:
        """Return the increment up to a share of it, where free coordinates (k,) are expected."""
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
                if factors and solution.outcome is Outcome.SLIPS:
                    return increment, increment.failed(now, solution.outcome, errors[-1], spent, solution.detail)
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

    def _error(self, now: Configuration, state: ContactState, unbalanced: Float) -> float:
        return self.residual(now, state, unbalanced)

    def _turning(self, now: Configuration, linearisation: Linearisation) -> Float:
        """Return loads (N, k) by which nodal contact forces change with each free coordinate."""
        return np.zeros((len(now.x), 0))

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
        turning = self._turning(now, linearisation)
        eliminated = linearisation.condensation.eliminated(np.column_stack([-unbalanced, turning]))
        read = eliminated.displacement[linearisation.reads]
        increment, solution, change = self.contact(now, force, linearisation, read[:, 0], read[:, 1:])
        by = np.append(1.0, (increment._free(increment.move.end) - self._free(self.move.end))[: turning.shape[1]])
        step = eliminated.unknowns(np.outer(change, np.eye(len(by))[0])) @ by
        length = float(np.abs(step[: self.problem.mesh.points.size]).max())
        if not solution.outcome.ok or not np.isfinite(step).all() or length > longest:
            return solution, None
        if secants is not None:
            reached = np.concatenate([now.x + step, solution.state.force.ravel(), increment._free(increment.move.end)])
            secants[:] = [*secants[-_SECANTS:], (reached, step)]
            ends, steps = zip(*secants, strict=True)
            end, coordinates = np.split(accelerated(ends, steps), [len(step) + force.size])
            step, force = end[: len(step)] - now.x, end[len(step) :].reshape(force.shape)
            solution = replace(solution, state=replace(solution.state, force=force))
            increment = increment._at(coordinates)
        try:
            return solution, (increment, *increment.moved(now, step, solution.state.force))
        except InvertedError:
            return solution, None


def _extrapolated(points: Sequence[tuple[float, Float]], share: float) -> Float:
    """Return the place (k,) at a share of a path, on the line through two points at other shares."""
    (s0, x0), (s1, x1) = points
    return np.asarray(x1 + (share - s1) / (s1 - s0) * (x1 - x0))


@dataclass(frozen=True)
class IncrementToForces(FiniteIncrement):
    """An increment to prescribed forces, with as many coordinates of its end as more unknowns of the iteration.

    In every iteration the object moves further by coordinates with which the contact forces f of the linearised body
    have the resultants Q ::

        contact conditions of f and of the gaps and slips with the object moved,    sum of f . v = Q

    Attributes
    ----------
    wanted : Q on the whole finger
    before : the same at the start
    """

    wanted: GeneralisedForces
    before: Float

    def _free(self, pose: ObjectPose) -> Float:
        return self.wanted.coordinates(pose)

    def _at(self, coordinates: Float) -> Self:
        return replace(self, move=Move(self.move.start, self.wanted.placed(self.move.end, coordinates)))

    def _part(self, share: float, coordinates: Float) -> Self:
        """Return the increment up to a share of the root of a normal force, with which the depth of contact grows."""
        if share == 1.0:
            return self
        values = self.before + share * (self.wanted.values - self.before)
        for i in np.flatnonzero(np.array(self.wanted.numbers) == 0):
            before, end = (math.sqrt(max(force, 0.0)) for force in (self.before[i], self.wanted.values[i]))
            values[i] = (before + share * (end - before)) ** 2
        pose = self.wanted.placed(self.move.at(share), coordinates)
        return replace(self, move=Move(self.move.start, pose), wanted=replace(self.wanted, values=values))

    @cached_property
    def _arm(self) -> float:
        return self.problem.model.design.height_mm

    def _fields(self, now: Configuration) -> tuple[Float, Float]:
        """Return motions of the object and fields of the resultants (n d, k) at the nodes."""
        problem, end, numbers = self.problem, self.move.end, self.wanted.numbers
        places = problem.mesh.points + displacement(problem.mesh, now.x)
        made = (field(problem, end, places, numbers) for field in (motions, resultants))
        motion, resultant = (field.reshape(-1, len(numbers)) for field in made)
        return motion, resultant

    def _error(self, now: Configuration, state: ContactState, unbalanced: Float) -> float:
        reached = self._fields(now)[1].T @ now.contact.nodal_forces(state.force).ravel()
        missing = self.wanted.values - 2.0 ** len(self.problem.axes) * reached
        return max(super()._error(now, state, unbalanced), float(np.abs(missing / self.wanted.scale(self._arm)).max()))

    def _turning(self, now: Configuration, linearisation: Linearisation) -> Float:
        loads = np.zeros((len(now.x), len(self.wanted.numbers)))
        if linearisation.turning is None:
            return loads[:, :0]
        motion = self._fields(now)[0]
        loads[: len(motion)] = -(linearisation.turning @ motion)  # the object moves as the body moves back
        return loads

    def _solved(
        self, now: Configuration, force: Float, contact: ContactProblem, turned: Float
    ) -> tuple[Self, ContactSolution[ContactState]]:
        """Move the object until the linearised body has the forces, by at most the largest step."""
        images = 2.0 ** len(self.problem.axes)
        motion, resultant = (
            np.array([self.active(-one).ravel() for one in now.contact.displacement(field).T]).T
            for field in self._fields(now)
        )
        if turned.size:
            motion = motion + turned
        reach = self._largest_step, self._arm
        conditions = self.wanted.conditions(motion, resultant, images, reach, _EXACT)
        solution, moved, lacking = solve_to_forces(self.problem.model.rule, contact, force, conditions)
        solution = self.wanted.checked(solution, now.contact.bases, images, lacking)
        end = self.wanted.moved(self.move.end, moved)
        return replace(self, move=Move(self.move.start, end)), solution
