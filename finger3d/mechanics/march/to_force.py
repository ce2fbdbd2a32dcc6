"""Increments to a prescribed normal force: with the depth as an unknown of the iteration, else by trial depths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar, Protocol

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import Coulomb
from finger3d.contact.state import ContactSolution
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import increment_to_force
from finger3d.mechanics.march.force_control import DepthSearch, Trial, is_similar, target
from finger3d.mechanics.march.parts import FIRST_PARTS, Advanced, Substep, expecting
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.elastic import SmallStrain
from finger3d.objects import Move, ObjectPose
from finger3d.progress import Progress

_NEAR = 0.2
"""Least ratio of a trial's force to the prescribed one, or back, from which the iteration to that begins."""

_HERTZ = 2.0 / 3.0
"""Power of the force with which the depth grows under a ball (Hertz 1881)."""


class Advancing(Protocol):
    """A press, as an increment to a force advances it; see `finger3d.mechanics.march.solve.Press`."""

    problem: Problem
    workspace: Any
    state: State[Any]

    def expected_force(self, pose: ObjectPose) -> Float | None:
        """Return the forces (c, d) N extrapolated to a pose, if the path continues in its last direction."""
        ...

    def moves_to(self, pose: ObjectPose) -> tuple[Move, ...]:
        """Return the motions in which an increment to a pose is solved."""
        ...

    def solved(
        self,
        start: State[Any],
        moves: Sequence[Move],
        guess: Float | None = None,
        near: Sequence[Substep] = (),
    ) -> tuple[ContactSolution[State[Any]], list[Substep]]:
        """Solve motions one after another; see `finger3d.mechanics.march.parts.solved_in_turn`."""
        ...


class ToForce:
    """An increment of a press to a normal force.

    The depth is an unknown of the iteration.  Where that does not converge, depths are tried, each from the forces that
    are expected from those before it.

    Parameters
    ----------
    press : whose next increment it is
    move : to the depth of the leg's forecast
    forces : before and at the end, N
    deepest : largest depth, mm
    report : Progress
        Receives remarks on the depth and the force of every trial.
    """

    tolerance: ClassVar[float] = target(finite_strain=False)
    first_shares: ClassVar[tuple[float, ...]] = ()
    """Shares of the force to which parts of an increment that begins without contact lead, each found directly; without
    any such an increment is found by trials, whose parts have shares of the depth."""

    def __init__(
        self, press: Advancing, move: Move, forces: tuple[float, float], deepest: float, report: Progress
    ) -> None:
        (self._force, self._wanted), self._press, self._move = forces, press, move
        self._deepest, self._report = deepest, report
        self._trials, self._parts = list[Trial](), dict[float, list[Substep]]()
        start_mm, start_s = move.start.depth_mm, move.start.time_s
        deepens = replace(move.end, depth_mm=start_mm, time_s=start_s) == move.start
        rest = ContactSolution(press.state, Outcome.CONVERGED, 0.0, 0, "none")
        begin = Trial(start_mm, rest, self._force) if deepens else None
        self._search = DepthSearch(self._tried, self._wanted, start_mm, deepest, begin, self.tolerance)

    def run(self, depth: float) -> Advanced:
        """Return the end of the increment, which is looked for first near an expected depth (mm).

        If the force is not reached, the solution says why, and state and pose are those at the beginning.
        """
        last = self._directly(depth) or self._search.run(depth)
        solution = replace(last.solution, iterations=sum(trial.solution.iterations for trial in self._trials))
        if not last.ok:
            return Advanced(replace(solution, state=self._press.state), [], self._move.start)
        return Advanced(solution, self._parts[last.depth], self._pose(last.depth))

    def _directly(self, depth: float) -> Trial | None:
        """Return the end with the depth as an unknown; None where the iteration does not converge."""
        if self._force <= 0.0 and not self.first_shares:
            return None
        there = Move(self._move.start, self._pose(depth))
        return self._to_force(self._press.state, there, self._press.expected_force(there.end), [])

    def _to_force(self, start: State[Any], move: Move, guess: Float | None, before: Sequence[Substep]) -> Trial | None:
        """Return the end of a part to the force, after other parts."""
        found = increment_to_force(self._press.problem, (start, guess), move, self._wanted, self._press.workspace)
        if found is None or found[0].end.depth_mm > self._deepest:
            return None
        move, solution = found
        part = Substep(start, solution.state, move, solution.residual)
        return self._noted(move.end.depth_mm, solution, [*before, part])

    def _tried(self, depth: float, good: Sequence[Trial]) -> Trial:
        """Return the increment to a depth (mm), after other trials."""
        pose = self._pose(depth)
        start, guess, near = self._press.state, self._press.expected_force(pose), list[Substep]()
        if good:
            (one, other), share = self._search.expected_ends(depth)
            guess = one.contact.force + share * (one.contact.force - other.contact.force)
            start, near = self._near(good[-1], depth, (one, other), share)
        return self._noted(depth, *self._press.solved(start, self._press.moves_to(pose), guess, near))

    def _near(
        self, last: Trial, depth: float, ends: tuple[State[Any], State[Any]], share: float
    ) -> tuple[State[Any], list[Substep]]:
        """Return the state and the parts near which a trial begins its iteration, besides the expected forces."""
        return self._press.state, []

    def _pose(self, depth: float) -> ObjectPose:
        return replace(self._move.end, depth_mm=depth)

    def _noted(self, depth: float, solution: ContactSolution[State[Any]], parts: list[Substep]) -> Trial:
        reached = math.nan
        if solution.outcome.ok:
            reached = normal_force(self._press.problem, solution.state)
            solution = replace(solution, residual=max(part.residual for part in parts))
        self._trials.append(Trial(depth, solution, reached))
        self._parts[depth] = parts
        text = f"{reached:.5g} N" if solution.outcome.ok else "no solution"
        self._report.remark(f"{self._wanted:.5g} N wanted, {text} at a depth of {depth:.4g} mm")
        return self._trials[-1]


class ToForceAtFiniteStrain(ToForce):
    """An increment to a normal force at finite strain, where every iteration from afar costs a factorisation.

    Trials begin at the end that is expected from those before.
    """

    tolerance: ClassVar[float] = target(finite_strain=True)
    first_shares: ClassVar[tuple[float, ...]] = FIRST_PARTS

    def _tried(self, depth: float, good: Sequence[Trial]) -> Trial:
        trial = super()._tried(depth, good)
        *parts, failed = self._parts[depth]
        if trial.solution.outcome is Outcome.NEWTON and parts:
            last = parts[-1]
            until_then = replace(trial.solution, state=last.after, outcome=Outcome.CONVERGED)
            before = self._noted(last.move.end.depth_mm, until_then, parts)
            return replace(trial, depth=failed.move.end.depth_mm, before=before)
        end = self._from_last(self._parts[depth]) if is_near(trial.force, self._wanted) else None
        return end or trial

    def _near(
        self, last: Trial, depth: float, ends: tuple[State[Any], State[Any]], share: float
    ) -> tuple[State[Any], list[Substep]]:
        start = expecting(self._press.state, Move(self._move.start, self._pose(depth)), ends, share)
        return start, self._parts[last.depth] if is_similar(depth, last.depth) else []

    def _from_last(self, parts: Sequence[Substep]) -> Trial | None:
        """Return the end of an increment whose last part goes to the force, near the end of a similar part."""
        *before, last = parts
        start = expecting(last.before, last.move, (last.after, last.after), 0.0)
        return self._to_force(start, last.move, last.after.contact.force, before)


def expected_depth(
    problem: Problem, last: Substep | None, move: Move, forces: tuple[float, float], deepest: float
) -> float:
    """Return the depth (mm) expected at a normal force: that of small strain where a body at finite strain begins it.

    Parameters
    ----------
    last : part of the increment before, if there is one
    move : to the depth of the leg's forecast
    forces : before and at the end, N
    deepest : largest depth, mm
    """
    force, wanted = forces
    if force <= 0.0 and problem.model.finite_strain:
        return _at_small_strain(problem, move.end, wanted, deepest)
    if last is None:
        return move.end.depth_mm
    before = last.move.start.depth_mm, normal_force(problem, last.before)
    return by_power_law(before, (move.start.depth_mm, force), wanted)


def _at_small_strain(problem: Problem, pose: ObjectPose, wanted: float, deepest: float) -> float:
    """Return a depth (mm) near that of a normal force (N) in small strain, from increments to the pose and onwards.

    They are frictionless, so that they are solved soon even where the pose is far too deep.  The depth is doubled until
    the object touches.
    """
    small, depth = SmallStrain(), pose.depth_mm
    like = replace(problem, model=replace(problem.model, friction=Coulomb(0.0)))
    workspace, rest = small.workspace(), small.start(like)

    def force_at(depth_mm: float) -> float:
        found = small.increment(like, rest, Move(problem.origin, replace(pose, depth_mm=depth_mm)), None, workspace)
        return normal_force(problem, found.state) if found.outcome.ok else math.nan

    force = force_at(depth)
    while force <= 0.0 < depth < 0.5 * deepest:
        depth *= 2.0
        force = force_at(depth)
    if not force > 0.0:
        return depth
    other = by_power_law((0.0, 0.0), (depth, force), wanted)
    again = force_at(other)
    return by_power_law((depth, force), (other, again), wanted) if again > 0.0 else other


def by_power_law(before: tuple[float, float], now: tuple[float, float], wanted: float) -> float:
    """Return the depth (mm) at a force, by the power of the force with which the depth has changed.

    The power is between 0 and 1, and that of Hertz's law where a force was none, or was the same.

    Parameters
    ----------
    before, now : depths (mm) and forces (N)
    wanted : N
    """
    (d0, f0), (d1, f1) = before, now
    if d1 <= 0.0 or f1 <= 0.0:
        return d1 + (d1 - d0)
    is_known = d0 > 0.0 and f0 > 0.0 and f0 != f1
    power = math.log(d1 / d0) / math.log(f1 / f0) if is_known else _HERTZ
    return float(d1 * (wanted / f1) ** min(max(power, 0.0), 1.0))


def is_near(force: float, wanted: float) -> bool:
    """Return whether an iteration to a force may begin at the end of an increment with another one (N)."""
    return _NEAR * wanted < force < wanted / _NEAR


def forces_on(problem: Problem, state: State[Any]) -> Float:
    """Return the normal force and the forces along x and z (3,) N, as in a `Load`."""
    x, y, z = problem.world_force(state.contact).sum(axis=0).tolist()
    return np.array([0.0 - y, x, z])


def normal_force(problem: Problem, state: State[Any]) -> float:
    """Return the normal force (N)."""
    return float(forces_on(problem, state)[0])
