r"""Derivatives of the increments of a press by its parameters, from the equations of their active sets.

The forces of an increment are linear functions r = P x of the unknowns of its active set, and the displacements of the
contact points are ``U = W B^T r``, with the directions B of the points.  Gap and slip w depend on U through the
geometry of the contact, and on the parameters through the state before and the motion of the object.  In ::

    D w + E x = 0,   dU = W (B^T (P dx + dmu e r_n) + dB^T r) + dW B^T r

(`finger3d.contact.newton.ActiveSet`) the derivatives of w and B are central differences between two sides, presses at a
parameter less and plus its step to first order, and those by U are the same for all parameters
(`finger3d.mechanics.small_strain.contact_slopes`).  They hold the curvature of the object, and where points touch
within the increment.  As dB is linear in dU, the forces d(B^T r) are eliminated, and one system for dx remains.

Under prescribed forces an increment is differentiated by depth and slides, too, which change so that they are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.contact.friction import OPEN, SLIP, Status
from finger3d.contact.state import ContactState
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.force_control import FORCE_TOLERANCE
from finger3d.mechanics.march.parts import FIRST_PARTS, Substep, energies
from finger3d.mechanics.march.path import Load, Station, stations
from finger3d.mechanics.march.to_force import forces_on
from finger3d.mechanics.results.history import StepResult
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.contact_slopes import ContactEnd, are_placed_alike
from finger3d.mechanics.small_strain.kinks import End, Sides, coefficients, one_sided
from finger3d.mechanics.small_strain.linear_contact import Increment, LinearBody
from finger3d.mechanics.small_strain.linearised import (
    Linear,
    LinearisedIncrement,
    Part,
    slopes,
    upright,
)
from finger3d.mechanics.small_strain.variations import Side, Variation, changes_of_points
from finger3d.objects import DistanceTracker, Move, ObjectPose, vertical_frame

Ends: TypeAlias = Sequence[tuple[ObjectPose, State[Any]]]
"""Pose and state at the end of every part of an increment."""

_STEP = 1e-6
"""Step of the depth in an increment under a prescribed force, over the depth; that of parameters is about as large."""


@dataclass(frozen=True)
class FixedForces:
    """Derivatives by p parameters, at fixed contact forces, of contact displacements (c d, p) and readings (g, p)."""

    displacement: Float
    readings: Float


class IncrementTangents:
    """Derivatives of a press, one increment after another.

    Parameters
    ----------
    problem : of the press
    variations : of p parameters
    steps : the increments of the press

    Attributes
    ----------
    sides : (2 p,) below and above each parameter, at the end of the last increment
    """

    def __init__(self, problem: Problem, variations: Sequence[Variation], steps: Sequence[StepResult]) -> None:
        self.problem, self._results = problem, steps
        self._steps = np.array([t for one in variations for t in (-one.step, one.step)])
        ends = [end for one in variations for end in one.ends]
        self.formulation = formulation_of(problem.model)
        self._here = Side(problem, self.formulation.start(problem), problem.origin, np.zeros(0), 0.0, 0.0)
        self.sides = [self._here._replace(problem=end, state=self._start(end)) for end in ends]
        self._variations = self._without_past = variations  # what they change follows from the present forces
        self._stations, self._number = [stations(end.model.legs) for end in ends], 0
        self._leg_start_N, self._left = np.zeros((len(ends), 3)), np.zeros((len(ends), 2))
        self._last: Sequence[Side] = self.sides  # at the beginning of the last part of an increment
        self._is_unknown = np.zeros(len(ends), dtype=bool)  # since a kink
        self._workspace, bodies = self.formulation.workspace(), [one.body for one in variations for _ in one.ends]
        self._workspaces = [self.formulation.workspace() if body else self._workspace for body in bodies]

    def advance(self, step: StepResult, way: int = 0) -> Sides:
        """Return the sides at the end of the next increment, which has this result.

        At a kink they are those of falling (`way` -1) or growing (1) parameters, or those of its own active set (0).

        Raises
        ------
        Finger3dError
            If the equations of an active set are singular, or the geometry of the contact has no derivative.
        """
        sides, here = self._sides(step), self._end(step)
        if way and here.is_kink:

            def solved(status: Status) -> tuple[list[Side], list[ContactState]]:
                return self._sides(step, status), [before.state.contact for before in self._last]

            chosen = one_sided(here, solved, way)
            self._is_unknown = self._is_unknown | np.array([side is None for side in chosen], dtype=bool)
            sides = [own or side for own, side in zip(chosen, sides, strict=True)]
        self.sides = sides
        self._here = self._here._replace(state=step.meshed_state, pose=step.target)
        self._number += 1
        return [None if unknown else side for unknown, side in zip(self._is_unknown, sides, strict=True)]

    def is_at_kink(self, step: StepResult) -> bool:
        """Whether the next increment, which has this result, ends as a point is about to change its status."""
        return self._end(step).is_kink

    def _end(self, step: StepResult) -> End:
        """Return the contact of the last part of an increment."""
        before, after = [self._here.state, *(state for _, state in step.parts)][-2:]
        return End(self.problem, before.contact, after.contact)

    def _sides(self, step: StepResult, status: Status | None = None) -> list[Side]:
        """Return the sides at the end of an increment, where the points may have other statuses (c,)."""
        targets = [own[self._number] for own in self._stations]
        ends, wanted = self._poses(targets), self._wanted(targets)
        moves = [Move(side.pose, end) for side, end in zip(self.sides, ends, strict=True)]
        sides, here = self.sides, self._here
        try:
            for share, found in _stages(self.problem, here.state, step, targets[0].load):
                last = status if share == 1.0 else None
                parts, poses = self._parts(here, found, last), [move.at(share) for move in moves]
                if wanted is not None:
                    poses = self._in_equilibrium(parts, (here, *sides), share * wanted, poses)
                sides = self._through(parts, sides, self._steps, poses)
                here = here._replace(state=found[-1][1], pose=found[-1][0])
            return list(sides)
        except np.linalg.LinAlgError:
            raise Finger3dError("the equations of an increment are singular: numbers have no derivatives") from None

    def _parts(self, here: Side, found: Ends, status: Status | None) -> list[Part]:
        """Return parts of an increment from a place, linearised; the points may have other statuses (c,) at the end."""
        end, parts = found[-1][0], list[Part]()
        whole, before, place, start = Move(here.pose, end).change, here.state, here.pose, 0.0
        for pose, after in found:
            if status is not None and after is found[-1][1]:
                after = replace(after, contact=replace(after.contact, status=status))
            way = Move(here.pose, pose).change
            share = 1.0 if pose == end else float(way @ whole) / float(whole @ whole)
            linear = self._linearised(before, after, move := Move(place, pose))
            parts.append(Part(before, after, linear, move, start, share))
            before, place, start = after, pose, share
        return parts

    def _start(self, problem: Problem) -> State[Any]:
        """Return the state at rest, which is that of the press where its contact is the same."""
        own = self.problem
        is_same = are_placed_alike(problem, own) and problem.system.object_share is own.system.object_share
        return self._here.state if is_same else self.formulation.start(problem)

    def _linearised(self, before: State[Any], after: State[Any], move: Move) -> Any:
        """Return the equations of a part of an increment that ends as the object has moved so from its beginning."""
        return Linear(LinearisedIncrement.of(self.problem, before.contact, after.contact), self.problem.delassus)

    def _workspaces_of(self, sides: Sequence[Side]) -> list[Any]:
        """Return the workspaces of sides: their own if a parameter changes the body, else that of the press."""
        return [*self._workspaces, *[self._workspace] * (len(sides) - len(self._workspaces))]  # some are of poses

    def _at_fixed_forces(self, part: Part, sides: Sequence[Side], steps: Float, moves: Sequence[Move]) -> FixedForces:
        """Return the derivatives of the body at the end of a part of an increment under its forces."""
        found = self._fixed[part.after.contact.force.tobytes()]
        more = len(steps) // 2 - len(self._variations)  # by poses, which change nothing in the body
        return FixedForces(*np.split(np.pad(found, ((0, 0), (0, more))), [self.problem.surface.points.size]))

    @cached_property
    def _fixed(self) -> dict[bytes, Float]:
        """Derivatives (c d + g, p) of contact displacements and readings under the forces at the ends of all parts."""
        contacts = [after.contact for step in self._results for _, after in step.parts]
        forces = np.stack([self.problem.upright_force(contact).ravel() for contact in contacts], axis=1)
        moved = changes_of_points(self.problem, self._without_past, forces)
        return {contact.force.tobytes(): moved[:, k] for k, contact in enumerate(contacts)}

    def _reached(
        self, part: Part, fixed: FixedForces, states: Sequence[State[Float]], sides: Sequence[Side], steps: Float
    ) -> list[tuple[State[Any], Float]]:
        """Return the states of all sides at the end of a part of an increment, and their readings (g,)."""
        forces = [self.problem.upright_force(state.contact).ravel() for state in states]
        read = self.problem.system.reading_rows @ np.transpose(forces) + np.repeat(fixed.readings, 2, axis=1) * steps
        return list(zip(states, read.T, strict=True))

    def _poses(self, targets: Sequence[Station]) -> list[ObjectPose]:
        """Return the poses at stations; slides that forces have determined are taken back in proportion to the leg."""
        before = [own[self._number - 1] for own in self._stations] if self._number else []
        if before and before[0].share == 1.0:
            planned = [station.pose.coordinates[1:3] for station in before]
            self._left = np.array([side.pose.coordinates[1:3] for side in self.sides]) - planned
        change = (1.0 - targets[0].share) * self._left
        return [target.pose.changed([1, 2], by) for target, by in zip(targets, change, strict=True)]

    def _wanted(self, targets: Sequence[Station]) -> Float | None:
        """Return the forces (2 p, 3) N prescribed at stations, NaN where there is none; None without any."""
        loads = [target.load for target in targets if target.load]
        if not loads:
            return None
        if loads[0].begins:
            self._leg_start_N = np.array([forces_on(side.problem, side.state) for side in self.sides])
        goals = np.array([load.forces for load in loads])
        return self._leg_start_N + loads[0].share * (goals - self._leg_start_N)

    def _in_equilibrium(
        self, parts: Sequence[Part], begin: Sequence[Side], wanted: Float, poses: Sequence[ObjectPose]
    ) -> list[ObjectPose]:
        """Return the poses after parts of an increment whose depth or slides follow from forces (2 p, 3), N.

        The parts begin at the place of the press and of all sides.
        """
        here, *sides = begin
        end, free = parts[-1].move.end, np.flatnonzero(~np.isnan(wanted[0]))
        reached, h = end.coordinates, _STEP * max(end.depth_mm, 1.0)
        held = [pose.changed(free, (reached - pose.coordinates)[free]) for pose in poses]
        moved = [end.changed([k], [t]) for k in free.tolist() for t in (-h, h)]
        steps = np.array([*self._steps, *[-h, h] * len(free)])
        found = self._through(parts, [*sides, *[here] * len(moved)], steps, [*held, *moved])
        forces = np.array([forces_on(side.problem, side.state) for side in found])
        missing = slopes(wanted - forces[: len(held)], self._steps)[free]
        stiffness = slopes(forces[len(held) :], steps[len(held) :])[free]
        try:
            change = np.linalg.solve(stiffness, missing)
        except np.linalg.LinAlgError:
            raise Finger3dError("forces do not determine the pose of the object: numbers have no derivatives") from None
        pairs = enumerate(zip(held, self._steps, strict=True))
        return [pose.changed(free, t * change[:, k // 2]) for k, (pose, t) in pairs]

    def _through(
        self, parts: Sequence[Part], sides: Sequence[Side], steps: Float, poses: Sequence[ObjectPose]
    ) -> list[Side]:
        """Return the sides after all parts of an increment, which ends in these poses."""
        moves = [Move(side.pose, pose) for side, pose in zip(sides, poses, strict=True)]
        for part in parts:
            self._last = sides
            sides = self._after(part, sides, steps, [Move(move.at(part.start), move.at(part.end)) for move in moves])
        return list(sides)

    def _after(self, part: Part, sides: Sequence[Side], steps: Float, moves: Sequence[Move]) -> list[Side]:
        """Return the sides after a part of an increment."""
        contact, linear, frame = part.after.contact, part.linear.active, vertical_frame(self.problem.dim)
        (c, d), p = contact.force.shape, len(sides) // 2
        delassus = part.linear.delassus.reshape(c * d, c * d)
        fixed = self._at_fixed_forces(part, sides, steps, moves)

        def displaced(problem: Problem, state: State[Any]) -> State[Float]:
            return replace(state, body=self.formulation.loads(problem, state, part.move.end).displacement)

        there = displaced(self.problem, part.after).body
        body = LinearBody(self.problem.delassus, np.zeros_like(there))

        def increment(problem: Problem, state: State[Any], move: Move) -> Increment:
            return Increment(problem, displaced(problem, state), move, body, DistanceTracker())

        own = ContactEnd.of(increment(self.problem, part.before, part.move), there)
        of_place, of_means = own.slopes(contact)
        pairs = zip(sides, moves, strict=True)
        ends = [own.beside(increment(side.problem, side.state, move)) for side, move in pairs]
        changes = slopes([end.conditions(contact) for end in ends], steps)
        direct = slopes([upright(contact, friction) for friction in rubbed(part, sides)], steps)
        # all by displacements in the directions of an upright object, and by forces on the points that touch
        of_moved = of_place @ sp.kron(sp.eye_array(c), frame.T)
        relative = (2 * d * np.arange(c)[:, None] + np.arange(d)).ravel()
        touches = np.flatnonzero(np.repeat(contact.status != OPEN, d))
        turned, through = (relative + d)[touches], delassus[:, touches]
        of_unknowns = linear.forces[touches].toarray()
        force = direct[touches] + changes[turned] + of_moved[turned] @ fixed.displacement
        if not self.problem.model.object.is_flat:  # forces turn with the directions of their points
            matrix = np.eye(len(touches)) - of_moved[turned] @ through
            both = np.linalg.solve(matrix, np.hstack([of_unknowns, force]))
            of_unknowns, force = np.hsplit(both, [of_unknowns.shape[1]])
        weights = linear.weights @ of_moved[relative]
        response = weights @ through
        matrix = response @ of_unknowns + np.diag(linear.diagonal)
        right = linear.weights @ changes[relative] + weights @ fixed.displacement + response @ force
        unknowns = -np.linalg.solve(matrix, right)
        moved = through @ (of_unknowns @ unknowns + force) + fixed.displacement
        place = np.einsum("ckp,kl->clp", moved.reshape(c, d, p), frame)
        means = (of_means @ place.reshape(-1, p)).reshape(c, -1, p)
        force = (linear.forces @ unknowns + direct).reshape(c, d, p)
        force = np.einsum("cak,ckp->cap", contact.own_bases @ frame.T, force)
        states = [
            end.moved(t * place[..., k // 2], t * means[..., k // 2]).state(contact, t * force[..., k // 2])
            for k, (end, t) in enumerate(zip(ends, steps, strict=True))
        ]
        reached = self._reached(part, fixed, states, sides, steps)
        return [side_after(*one) for one in zip(sides, moves, *zip(*reached, strict=True), strict=True)]


def _stages(problem: Problem, before: State[Any], step: StepResult, load: Load | None) -> list[tuple[float, Ends]]:
    """Return the ends of the parts of an increment that are found for a share of its forces, by that share.

    Where contact begins under a normal force there are several; they are told by the force that they end with.
    """
    if load is not None and load.is_normal and not before.contact.force.any():
        forces = np.array([forces_on(problem, state)[0] for _, state in step.parts])
        ends = np.abs(forces - np.outer(FIRST_PARTS, forces[-1:])).argmin(axis=1)
        if np.allclose(forces[ends], np.multiply(FIRST_PARTS, forces[-1]), rtol=0.0, atol=FORCE_TOLERANCE * forces[-1]):
            cuts = pairwise([0, *(ends + 1).tolist(), len(forces)])
            return [(share, step.parts[slice(*cut)]) for share, cut in zip((*FIRST_PARTS, 1.0), cuts, strict=True)]
    return [(1.0, step.parts)]


def side_after(before: Side, move: Move, state: State[Any], readings: Float) -> Side:
    """Return the side after a motion that has led to a state with readings (g,)."""
    work, lost = energies(before.problem, [Substep(before.state, state, move)])
    return Side(before.problem, state, move.end, readings, before.work_mJ + work, before.dissipation_mJ + lost)


def readings_of(problem: Problem, state: State[Any]) -> Float:
    """Return the readings (g,) of a state."""
    found = formulation_of(problem.model).readings(problem, state)
    return np.array([found[column] for column in problem.model.columns])


def rubbed(part: Part, sides: Sequence[Side]) -> list[Float]:
    """Return the friction (c, d) N of slipping points for the coefficients of friction of sides."""
    after, before = part.after.contact, part.before.contact
    slid, along = after.accumulated_slip - before.accumulated_slip, after.force[:, 1:]
    along = np.where(np.any(along != 0.0, axis=1, keepdims=True), along, -slid)
    length = np.linalg.norm(along, axis=1)
    slips = (length > 0.0) & (after.status == SLIP)
    share = np.divide(after.force[:, 0], length, out=np.zeros_like(length), where=slips)
    friction = np.column_stack([np.zeros(len(along)), along * share[:, None]])
    mus = [coefficients(side.problem, side.state.contact, after.status) for side in sides]
    return [friction * mu[:, None] for mu in mus]
