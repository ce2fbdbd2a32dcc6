"""Increments to a pose at which the object is in equilibrium with the forces and moments applied to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import brentq

from finger3d._types import Float
from finger3d.contact.friction import SLIP, Coulomb
from finger3d.contact.state import SNAPPED, ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.generalised import GeneralisedForces, forces_on
from finger3d.mechanics.history import State
from finger3d.mechanics.model import Leg
from finger3d.mechanics.small_strain import SmallStrain, transported
from finger3d.objects import TIME, ContactPath, Move, ObjectPose, PlacedObject, first_touch

FIRST_PARTS = 1.0 / 16.0, 0.25
"""Shares at which an increment that begins without contact is cut: of its depth, quarters and halves of the contact's
length under a ball, or of its force, the same under a cylinder.  In the first part points move freely until one of them
touches, which says nothing of how they move later."""


@dataclass(frozen=True)
class Substep:
    """A converged part of an increment: states before and after, the motion of the object, and the residual."""

    before: State[Any]
    after: State[Any]
    move: Move
    residual: float = 0.0


@dataclass(frozen=True)
class Advanced:
    """End of an increment: its solution, the converged parts, and the pose that was reached."""

    solution: ContactSolution[State[Any]]
    parts: list[Substep]
    pose: ObjectPose


def solved_in_turn(
    problem: Problem,
    workspace: Workspace,
    state: State[Any],
    moves: Sequence[Move],
    cuts: int,
    guess: Float | None = None,
) -> tuple[ContactSolution[State[Any]], list[Substep]]:
    """Solve the parts of an increment one after another; the guess (c, d), N, of the forces is that of the last.

    A part that does not converge is halved and repeated from the same state, at most `cuts` times.
    """
    found, parts, now = list[ContactSolution[State[Any]]](), list[Substep](), state
    for move in moves:
        start = guess if move is moves[-1] else None
        end, more = _solved(problem, workspace, now, move, cuts, start)
        found, parts, now = [*found, end], parts + more, end.state
        if not end.outcome.ok:
            now = end.state if end.outcome.is_cycle else state
            break
    return combined(found, now), parts


def combined(solutions: Sequence[ContactSolution[State[Any]]], state: State[Any]) -> ContactSolution[State[Any]]:
    """Return the solution of an increment, which ends at a state, from those of its parts."""
    return replace(
        solutions[-1],
        state=state,
        residual=max(one.residual for one in solutions),
        iterations=sum(one.iterations for one in solutions),
        method=SNAPPED if any(one.method == SNAPPED for one in solutions) else solutions[-1].method,
    )


def _solved(
    problem: Problem, workspace: Workspace, state: State[Any], move: Move, cuts: int, guess: Float | None
) -> tuple[ContactSolution[State[Any]], list[Substep]]:
    whole = formulation_of(problem.model).increment(problem, state, move, guess, workspace)
    if whole.outcome.ok or cuts == 0:
        return whole, [Substep(state, whole.state, move, whole.residual)]
    workspace.report.remark(f"no equilibrium in one step to a depth of {move.end.depth_mm:.4g} mm: halved")
    halves, parts = solved_in_turn(problem, workspace, state, move.cut(0.5), cuts - 1)
    method = SNAPPED if halves.method == SNAPPED else "cut back"
    return replace(halves, iterations=whole.iterations + halves.iterations, method=method), parts


def energies(problem: Problem, parts: Sequence[Substep]) -> tuple[float, float]:
    """Return the work of the object and the dissipation (mJ) in converged parts."""
    work = sum(external_work(problem, part.before, part.after, part.move) for part in parts)
    lost = sum(frictional_dissipation(problem, part.before.contact, part.after.contact) for part in parts)
    return work, lost


def external_work(problem: Problem, before: State[Any], after: State[Any], move: Move) -> float:
    """Return the work (mJ) of the object on the finger in an increment.

    It is the work of the contact forces on the body plus the frictional dissipation, by the trapezoidal rule.
    """
    start, end = transported(before.contact, after.contact.own_bases), after.contact
    friction = 0.5 * (start.force + end.force)[:, 1:]
    rubbed = np.einsum("ct,ct->c", friction, end.tangential_displacement - start.tangential_displacement)
    formulation = formulation_of(problem.model)
    on_body = formulation.loads(problem, after, move.end).work_from(formulation.loads(problem, before, move.start))
    return float(2 ** len(problem.axes) * on_body - problem.symmetry.total(rubbed))


def frictional_dissipation(problem: Problem, before: ContactState, after: ContactState) -> float:
    """Return the frictional dissipation (mJ): slip times the friction under the mean normal force; never negative.

    Direction and coefficient of friction are those at the end of the increment.
    """
    slips = after.status == SLIP
    lost = -np.sum(after.force[:, 1:] * (after.accumulated_slip - before.accumulated_slip), axis=1) * slips
    end = after.force[:, 0]
    ratio = np.divide(0.5 * (before.force[:, 0] + end), end, out=np.ones_like(end), where=end > 0.0)
    return problem.symmetry.total(lost * ratio)


_DEEPEST = 0.99
"""Largest depth at which a force is searched for, over that at which the object would reach the finger's base."""

_GRADED = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 100)])
"""Distances from the place of first touch at which the overlap is found for a forecast, over the finger's extent."""

_ENDS = np.array([-1.0, 1.0])

_BEYOND = 1.1
"""Depth reached, over its forecast, from which the contact may lie beyond the fine part of the mesh."""


def deepest(way: ContactPath, first_contact_mm: float, height: float) -> float:
    """Return the largest depth (mm) at which a force is looked for: neither finger nor object reaches the base there.

    Parameters
    ----------
    way : the object, and the extents of the finger; its poses are not looked at
    first_contact_mm : height of the object's lowest point at first touch
    height : of the finger, mm
    """
    lowest = first_contact_mm
    if way.object.is_flat:  # it has no lowest point; over the base it is lowest at a corner
        x, z = np.meshgrid(way.half_length_mm * _ENDS, way.half_width_mm * _ENDS)
        lowest = float(PlacedObject.of(way.object, first_contact_mm).height(x.ravel(), z.ravel()).min())
    return _DEEPEST * min(height, lowest)


def forecast_depth(way: ContactPath, material: Isotropic, force: float, height: float, width: float) -> float:
    """Return a rough depth (mm) for a force (N): an elastic foundation under the overlap of object and finger.

    Its modulus is E / (1 - nu^2).  Its thickness is 1.2 times the finger's height, or b max(1.2, log(2.8 l / b) - 0.5)
    if that is less, with the half width b of the overlap and the finger's height l, or half the length of the overlap
    if that is less and ends on the finger.  These are 1.2 times those that give the depth of a layer, and that of a
    line contact (Johnson 1985, eq. 5.56).  In 13 presses of sections and solids the forecast was 0.75 to 2.3 times the
    depth, in sections under round objects 0.9 to 1.1 times.
    It serves to mesh the contact and to choose candidate points; the press finds the depth.
    """
    touch = first_touch(way)
    lines = [
        np.unique(np.clip(middle + np.outer([-1.0, 1.0], 2.0 * half * _GRADED), -half, half))
        for half, middle in zip((way.half_length_mm, way.half_width_mm), touch.place, strict=True)
    ]
    x, z = np.meshgrid(*lines, indexing="ij")
    weight = [0.5 * (np.diff(line, append=line[-1]) + np.diff(line, prepend=line[0])) for line in lines]
    plan = np.outer(weight[0], weight[1] if way.half_width_mm else [width])
    gap = PlacedObject.of(way.object, touch.height_mm, ObjectPose(0.0)).height(x, z) - way.top(x, z)
    gap = np.where(np.isfinite(gap), gap, np.inf)
    modulus = material.E_MPa / (1.0 - material.nu**2)

    def pressed(depth: float) -> float:
        overlap = np.maximum(depth - gap, 0.0)
        inside = overlap > 0.0
        halves = [0.5 * float(np.ptp(side[inside])) + 1e-6 * height if inside.any() else height for side in (x, z)]
        ends = [half for half, most in zip(halves, (way.half_length_mm, way.half_width_mm), strict=True) if half < most]
        b, length = min(ends, default=height), min(max(ends), height) if len(ends) == 2 else height
        thickness = min(b * max(1.2, math.log(2.8 * length / b) - 0.5), 1.2 * height)
        return modulus * float((overlap * plan).sum()) / thickness

    most = deepest(way, touch.height_mm, height)
    depth = brentq(lambda depth: pressed(depth) - force, 0.0, most) if pressed(most) > force else most
    return float(f"{depth:.4g}")


def at_depth_reached(legs: tuple[Leg, ...], reached_mm: float) -> tuple[Leg, ...] | None:
    """Return the legs with the depth reached in place of a forecast that was too small; None if none was."""
    forced = [leg.depth_mm for leg in legs if leg.force_N is not None]
    if not forced or reached_mm <= _BEYOND * max(forced):
        return None
    return tuple(leg if leg.force_N is None else replace(leg, depth_mm=reached_mm) for leg in legs)


FORCE_TOLERANCE, FORCE_TOLERANCE_IF_FACTORED = 1e-10, 1e-6
"""Largest relative error of prescribed forces that are reached, in small strain and where the stiffness is factored."""

_SAME_DEPTH = 1e-3
"""Relative change of the depth in whose shares contact begins below which they stay; they change it by 1e-5 at most."""

_DEPTH_ITERATIONS = 12
"""Largest number of depths in whose shares contact begins; each changes the next by a thousandth of its error."""

_CUTS_IF_FACTORED = 3
"""Times that an increment at large deformation is halved, at most."""

_DEPTHS = (1.0, 0.5, 0.25, 0.125)
"""Shares of the way to the largest depth at which a force is looked for that is larger than those found."""

_HERTZ = 2.0 / 3.0
"""Power of the force with which the depth grows under a ball (Hertz 1881)."""


@dataclass(frozen=True)
class ToForces:
    """An increment of a press to forces and moments, with as many coordinates of the pose as unknowns of the iteration.

    One that does not converge is halved and repeated.

    Attributes
    ----------
    problem, workspace : of the press
    state : at the beginning
    last : part of the increment before, if there is one
    guess : function that returns the contact forces (c, d) N expected at a pose, if any are
    cuts : times that it is halved, at most
    """

    problem: Problem
    workspace: Any
    state: State[Any]
    last: Substep | None
    guess: Callable[[ObjectPose], Float | None]
    cuts: int

    def run(self, move: Move, before: GeneralisedForces, after: GeneralisedForces) -> Advanced:
        """Return the end of an increment as the forces change from those before to those after.

        Where contact begins, it is solved in parts, to shares of the forces.  If the object is not held, the solution
        says why, and state and pose are those at the beginning.
        """
        model = self.problem.model
        if self.last is not None and self._changes_nothing(move, before, after):
            rest = Substep(self.state, self.state, Move(move.start, move.start), self.last.residual)
            held = ContactSolution(self.state, Outcome.CONVERGED, self.last.residual, 0, "held")
            return Advanced(held, [rest], move.start)
        begins = model.begins_in_parts and not self.state.contact.force.any()
        ends = self._by_depths(move, before, after) if begins and not model.finite_strain else []
        now, begin = before, move.start
        for share in () if ends else ((*FIRST_PARTS, 1.0) if begins else (1.0,)):
            wanted = after if share == 1.0 else replace(after, values=share * after.values)
            by_force = 0 in after.numbers and share < 1.0
            end = self._of_share(move, share) if by_force else move.at(share)
            ends += self._parts(ends[-1] if ends else None, Move(begin, end), (now, wanted), self.cuts)
            if not ends[-1].solution.outcome.ok:
                return Advanced(combined([end.solution for end in ends], self.state), [], move.start)
            now, begin = wanted, ends[-1].pose
        solution = combined([end.solution for end in ends], ends[-1].solution.state)
        return Advanced(solution, [part for end in ends for part in end.parts], ends[-1].pose)

    def _changes_nothing(self, move: Move, before: GeneralisedForces, after: GeneralisedForces) -> bool:
        """Return whether forces and coordinates are held that the state has, in a body that does not relax."""
        if self.problem.model.relaxation is not None:
            return False
        rests = not np.delete(move.change, [*after.places, TIME]).any()
        scale = after.scale(self.problem.model.design.height_mm)
        return rests and bool((np.abs(after.values - before.values) <= self._round_off * scale).all())

    def _by_depths(self, move: Move, before: GeneralisedForces, after: GeneralisedForces) -> list[Advanced]:
        """Return the parts of an increment that begins contact, at shares of the depth that has the force at its end.

        They are those of a press to that depth.  There are none where the iteration of the depth does not converge.
        """
        last = self._once(None, move, (before, after))
        for _ in range(_DEPTH_ITERATIONS):
            if not last.solution.outcome.ok:
                return []
            depth = last.pose.depth_mm
            moves = Move(move.start, last.pose).cut(*FIRST_PARTS)[:-1]
            found, parts = solved_in_turn(self.problem, self.workspace, self.state, moves, self.cuts)
            first = Advanced(found, parts, moves[-1].end)
            if not found.outcome.ok:
                return []
            reached = replace(after, values=self._forces(found.state, first.pose)[list(after.numbers)])
            last = self._once(first, Move(first.pose, move.end), (reached, after), last)
            if abs(last.pose.depth_mm - depth) <= _SAME_DEPTH * abs(depth):
                return [first, last]
        return []

    def _of_share(self, move: Move, share: float) -> ObjectPose:
        """Return the pose at which a share of the forces of an increment that begins contact is expected."""
        return replace(move.at(share), depth_mm=by_power_law((0.0, 0.0), (move.end.depth_mm, 1.0), share))

    def _parts(
        self, before: Advanced | None, move: Move, forces: tuple[GeneralisedForces, GeneralisedForces], cuts: int
    ) -> list[Advanced]:
        """Return the parts of an increment after another one; the outcome of the last says why it ends there."""
        begin, wanted = forces
        found = self._once(before, move, forces)
        cuts = min(cuts, _CUTS_IF_FACTORED) if self.problem.model.finite_strain else cuts
        if found.solution.outcome.ok or found.solution.outcome in (Outcome.SLIPS, Outcome.NOT_HELD):
            return [found]
        if cuts == 0:
            return [self._ended(before, move, forces, found)]
        half = replace(wanted, values=0.5 * (begin.values + wanted.values))
        first = self._parts(before, Move(move.start, move.at(0.5)), (begin, half), cuts - 1)
        last = first[-1]
        if not last.solution.outcome.ok:
            return first
        return [*first, *self._parts(last, Move(last.pose, move.end), (half, wanted), cuts - 1)]

    def _once(
        self,
        before: Advanced | None,
        move: Move,
        forces: tuple[GeneralisedForces, GeneralisedForces],
        expected: Advanced | None = None,
    ) -> Advanced:
        """Return a part of an increment after another one, whose iteration begins at an end that is expected."""
        state, wanted = (before.solution.state if before else self.state), forces[1]
        problem, formulation = self.problem, formulation_of(self.problem.model)
        begin = Move(move.start, expected.pose) if expected else self._begin(before, move, forces)
        guess: Float | None = expected.solution.state.contact.force if expected else None
        if before is None:
            guess = self.guess(begin.end)
        solution = formulation.increment(problem, state, begin, guess, self.workspace, wanted)
        failed = Advanced(replace(solution, state=state), [], move.start)
        asked, fingers = str(wanted), 1
        if problem.system.second is not None:  # the normal force is that of both
            asked, fingers = "equilibrium", 2
        if not solution.outcome.ok:
            self.workspace.report.remark(f"{asked} wanted, no solution near a depth of {begin.end.depth_mm:.4g} mm")
            return failed
        there = _reached_by(solution)
        reached = self._forces(solution.state, there.end)
        missing = wanted.values - reached[list(wanted.numbers)]
        error, round_off = np.abs(missing / wanted.scale(problem.model.design.height_mm)).max(), self._round_off
        self.workspace.report.remark(
            f"{asked} wanted, {reached[0] / fingers:.5g} N at a depth of {there.end.depth_mm:.4g} mm"
        )
        if error > round_off:
            return replace(failed, solution=replace(failed.solution, outcome=Outcome.NO_CONVERGENCE))
        if there.end.depth_mm > self._deepest:
            return replace(failed, solution=replace(failed.solution, outcome=Outcome.FORCE_NOT_REACHED))
        if reached[0] <= round_off * wanted.size and self._touches(state, begin):
            left = replace(failed.solution, outcome=Outcome.NOT_HELD, detail="the object leaves the finger")
            return replace(failed, solution=left)
        return Advanced(solution, [Substep(state, solution.state, there, solution.residual)], there.end)

    def _begin(self, before: Advanced | None, move: Move, forces: tuple[GeneralisedForces, GeneralisedForces]) -> Move:
        """Return the motion to a pose where the iteration begins: near the depth that is expected, else as it was."""
        now, wanted = forces
        end = wanted.placed(move.end, wanted.coordinates(move.start))
        if 0 not in wanted.numbers:
            return Move(move.start, end)
        place = wanted.numbers.index(0)
        last = before.parts[-1] if before else self.last
        depth = move.end.depth_mm
        if now.values[place] <= 0.0 and self.problem.model.finite_strain:
            depth = self._in_small_strain(replace(end, depth_mm=depth), wanted.values[place])
        elif abs(wanted.values[place] - now.values[place]) <= self._round_off * wanted.size:
            depth = move.start.depth_mm  # what is held moves nothing
        elif last is None and wanted.asked[0] > 0.0:  # of the depth at the end of the leg, `move` has a share
            depth *= (wanted.values[place] / wanted.asked[0]) ** (_HERTZ - 1.0)
        elif last is not None:
            there = last.move.start.depth_mm, self._normal_force(last.before, last.move.start)
            depth = by_power_law(there, (move.start.depth_mm, now.values[place]), wanted.values[place])
        return Move(move.start, replace(end, depth_mm=min(depth, self._deepest)))

    def _in_small_strain(self, pose: ObjectPose, wanted: float) -> float:
        """Return the depth (mm) of a normal force in small strain, without friction."""
        small, like = SmallStrain(), replace(self.problem, model=replace(self.problem.model, friction=Coulomb(0.0)))
        force = GeneralisedForces((0,), np.array([wanted]), wanted)
        found = small.increment(like, small.start(like), Move(like.origin, pose), None, small.workspace(), force)
        return _reached_by(found).end.depth_mm if found.outcome.ok else pose.depth_mm

    @cached_property
    def _deepest(self) -> float:
        model = self.problem.model
        return deepest(model.contact_path, self.problem.system.first_contact_mm, model.design.height_mm)

    @property
    def _round_off(self) -> float:
        """Relative error of forces that are equal but for round-off."""
        return FORCE_TOLERANCE_IF_FACTORED if self.problem.model.finite_strain else FORCE_TOLERANCE

    def _forces(self, state: State[Any], pose: ObjectPose) -> Float:
        return forces_on(self.problem, formulation_of(self.problem.model).loads(self.problem, state, pose).forces, pose)

    def _normal_force(self, state: State[Any], pose: ObjectPose) -> float:
        return float(self._forces(state, pose)[0])

    def _plainly(self, state: State[Any], move: Move) -> ContactSolution[State[Any]]:
        return formulation_of(self.problem.model).increment(self.problem, state, move, None, self.workspace)

    def _touches(self, state: State[Any], move: Move) -> bool:
        """Return whether the object touches at the end of a motion."""
        found = self._plainly(state, move)
        return found.outcome.ok and self._normal_force(found.state, move.end) > 0.0

    def _ended(
        self,
        before: Advanced | None,
        move: Move,
        forces: tuple[GeneralisedForces, GeneralisedForces],
        found: Advanced,
    ) -> Advanced:
        """Return the end of an increment that does not converge, with the forces that are nearest to those wanted."""
        wanted, solution = forces[1], found.solution
        if wanted.numbers == (0,):
            force, depth = self._normal_force(solution.state, move.start), move.start.depth_mm
            # the first that has a solution; at large deformation each that has none costs tens of factorisations
            for share in () if self.problem.model.finite_strain else _DEPTHS:
                deeper = depth + share * (self._deepest - depth)
                found_there = self._plainly(solution.state, Move(move.start, replace(move.end, depth_mm=deeper)))
                if found_there.outcome.ok:
                    there = self._normal_force(found_there.state, replace(move.end, depth_mm=deeper))
                    force, depth = (there, deeper) if there > force else (force, depth)
                    break
            detail = f"{wanted.asked[0]:.6g} N asked; the largest force is {force:.6g} N, at a depth of {depth:.4g} mm"
            if force <= 0.0:
                detail = f"{wanted.asked[0]:.6g} N asked; the object does not touch the finger"
            cycles = solution.outcome.is_cycle or solution.outcome is Outcome.NO_CONVERGENCE
            outcome = Outcome.FORCE_NOT_REACHED if cycles else solution.outcome
            detail = "; ".join(text for text in (solution.detail, detail) if text)
            return replace(found, solution=replace(solution, outcome=outcome, detail=detail))
        begin = self._begin(before, move, forces)
        plain = self._plainly(solution.state, begin)
        if not plain.outcome.ok:
            return found
        missing = wanted.values - self._forces(plain.state, begin.end)[list(wanted.numbers)]
        detail = f"the nearest forces differ by {np.abs(missing).max():.3g} N"
        return replace(found, solution=replace(solution, outcome=Outcome.NOT_HELD, detail=detail))


def _reached_by(solution: ContactSolution[State[Any]]) -> Move:
    """Return the motion of an increment to forces."""
    assert solution.state.last is not None
    return solution.state.last[0]


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
