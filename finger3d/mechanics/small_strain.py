"""Small strain: increments of contact between a linear body and an object, along its true normals.

The nearest surface of an object is the one that a point came from only while the point has not passed the middle of the
object.  Beyond it a solution with the point on the far side satisfies all contact conditions.  Increments in which this
may happen, or did, are not converged, so that they are halved.

The displacement U of the contact points is linear in their forces, U = W f + U_past, and the gap and the normal of each
point follow from its present place.  Contact is solved with gaps linearised at a displacement, and the
displacement is updated from the forces, until both agree.  Without curvature and rotation one solution is exact.

At an edge of the object the normal of a point may jump.  Where directions do not converge, they are held fixed: every
normal between those of the adjacent faces is one of the edge (its generalised gradient, Clarke 1983).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, ContactProblem
from finger3d.contact.friction import OPEN
from finger3d.contact.resultants import solve_to_forces
from finger3d.contact.solve import RULES
from finger3d.contact.state import ContactSolution, ContactState, next_state
from finger3d.errors import Outcome
from finger3d.fem.mesh import in_space
from finger3d.fem.recovery import displacement
from finger3d.fem.surface import BoundarySurface
from finger3d.fem.tensors import rotated_delassus
from finger3d.mechanics.discretise.contact_points import ContactGeometry, contact_geometry
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Loads, Workspace, length_scale
from finger3d.mechanics.generalised import GeneralisedForces, motions, resultants
from finger3d.mechanics.history import B, State
from finger3d.mechanics.readings import Column
from finger3d.objects import DistanceTracker, Move, ObjectPose, vertical_frame

_MOST_CHORD = 0.5
"""Largest motion of the object in an increment, over its mean chord in the direction of the motion."""

_MOST_TURN = np.pi / 6.0
"""Largest turn (rad) of an object in an increment."""

_LEAVES = 0.5
"""Least cosine between the normal and the path of a point that leaves the object."""

_OPPOSED = -0.1
"""Largest cosine between the normals of two opposite faces; a point may slide around an edge between other faces."""

_TRACED = 40
"""Largest number of steps along the path of a point; a point that needs more grazes the surface."""

_TOUCHES = 1e-6
"""Distance at which a point touches the object, over the length of its path."""


def moves_too_far(problem: Problem, move: Move, gap: Float, carried: Float) -> bool:
    """Return whether the object moves too far for its near side to be the nearest.

    Parameters
    ----------
    gap : (c,) mm, of the contact points at the start
    carried : (c, d) mm
        Motion of the object's material at the contact points, see `carried_by_object`.
    """
    thing = problem.model.object
    if thing.is_flat:
        return False
    if float(np.abs(np.subtract(move.end.turns, move.start.turns)).max()) > _MOST_TURN:
        return True
    length = np.linalg.norm(carried, axis=1)
    length[gap >= length] = 0.0  # out of reach
    farthest = int(length.argmax())
    if not length[farthest]:
        return False
    motion = in_space(carried[farthest][None]) @ problem.placed(move.start).turned
    return bool(length[farthest] > _MOST_CHORD * thing.mean_chord(motion[0] / length[farthest]) * (1.0 + 1e-9))


def passes_through(problem: Problem, move: Move, before: Float, after: Float, gap: Float) -> bool:
    """Return whether a contact point enters the object and leaves it at an opposite face, or ends there.

    A point leaves the object roughly along the surface's normal.  One that slides over a round object moves along the
    chord of an arc, nearly perpendicular to the normal, and does not count.

    Parameters
    ----------
    before, after : (c, d) mm, displacements of the contact points at the start and at the end
    gap : (c,) mm, of the contact points at the start
    """
    thing = problem.model.object
    if thing.is_flat:
        return False
    points = problem.surface.points
    start = problem.placed(move.start).to_own(in_space(points + before))
    path = problem.placed(move.end).to_own(in_space(points + after)) - start
    length = np.linalg.norm(path, axis=1)
    near = np.flatnonzero((np.maximum(gap, 0.0) < length) & (length > 0.0))
    value, normal = thing.distance(start[near])
    enters = np.einsum("ni,ni->n", normal, path[near]) < 0.0
    near, value, entered = near[enters], value[enters], normal[enters]
    outside, normal = thing.distance(start[near] + path[near])
    leaves = np.einsum("ni,ni->n", normal, path[near]) > _LEAVES * length[near]
    leaves &= np.einsum("ni,ni->n", normal, entered) < _OPPOSED
    near, value, outside = near[leaves], value[leaves], outside[leaves]
    if not len(near):
        return False
    touches = _TOUCHES * length[near]
    if ((value <= touches) | (outside <= touches)).any():
        return True
    start, length, touches = start[near], length[near], touches
    along, distance = path[near] / length[:, None], np.zeros(len(near))
    for _ in range(_TRACED):  # no surface is nearer than the distance, so that no step passes one
        distance += value
        moving = distance < length
        if not moving.any():
            return False
        start, length, touches, along, distance = (v[moving] for v in (start, length, touches, along, distance))
        value = thing.distance(start + distance[:, None] * along)[0]
        if (value <= touches).any():
            return True
    return True


def pulls(problem: Problem, before: ContactState, after: ContactState, move: Move) -> bool:
    """Return whether a convex object that only moves deeper begins to pull the finger, which it cannot."""
    thing = problem.model.object
    along_x, up, along_z = move.end.displacement - move.start.displacement
    only_deeper = move.start.turns == move.end.turns and up < 0.0 and not (along_x or along_z)
    if thing.is_flat or not thing.is_convex or problem.system.second is not None or not only_deeper:
        return False
    normal = [float(problem.world_force(state)[:, 1].sum()) for state in (before, after)]
    return normal[0] <= 0.0 < normal[1] - _TOUCHES * float(np.abs(after.force).max(initial=0.0))


_TARGET = 1e-9
"""Error of the geometry at which the iteration ends; below `TOLERANCE`, to which other errors add."""

_EXACT = 1e-12
"""Relative error of prescribed forces at which the contact of the body is solved."""

_MOST_SOLUTIONS = 30
"""Largest number of solutions of an increment."""

_HOLD_FROM, _HOLD_ABOVE = 4, 1e-4
"""Iteration, at about the same depth, from which mean gradients of the distance are held fixed if they still change by
more than this."""

_NEAR = 0.05
"""Distance, over the depth, within which points are evaluated again while an increment is solved."""

_MEMORY, _SAME = 3, 1e-10
"""Earlier displacements from which the next is extrapolated, and singular value of the differences of their steps, over
the largest, below which it counts as zero."""


@dataclass(frozen=True)
class LinearBody:
    """A linear body at its contact points, over one increment.

    Attributes
    ----------
    delassus : (c, d, c, d) mm/N
        In the directions of an upright object.
    past : (c, d) mm
        Displacement without contact forces, in the same directions.
    """

    delassus: Float
    past: Float

    def displacement(self, force: Float, bases: Float) -> Float:
        """Return the displacement (c, d) in x, y, z under forces (c, d) along each point's own directions (c, d, d)."""
        frame = vertical_frame(force.shape[1])
        upright = np.einsum("ca,cak->ck", force, bases) @ frame.T
        touching = np.flatnonzero(force.any(axis=1))
        first = int(touching[-1:].sum()) + 1  # in most presses the deepest points come first, and need no copy
        own = slice(first) if first < 2 * len(touching) else touching
        moved = self.past + np.tensordot(upright[own], self.delassus[own], 2)  # which is symmetric
        return np.asarray(moved @ frame)


def accelerated(ends: Sequence[Float], steps: Sequence[Float], rcond: float | None = None) -> Float:
    """Return the next z (m,) of a fixed-point iteration z -> g(z), accelerated by secants (Anderson 1965).

    It is the combination of g(z) in the last iterations, with weights of sum 1, that has the shortest step.

    Parameters
    ----------
    ends : g(z) (m,) of each iteration
    steps : (k,), g(z) - z or as much of it as is to be short
    rcond : singular value of the differences of steps, over the largest, that counts as none
    """
    weights = np.linalg.lstsq(np.diff(steps, axis=0).T, steps[-1], rcond=rcond)[0]
    return np.asarray(ends[-1] - weights @ np.diff(ends, axis=0))


@dataclass(frozen=True)
class Increment:
    """An increment from a state, as the object moves."""

    problem: Problem
    state: State[Float]
    move: Move
    body: LinearBody
    tracker: DistanceTracker

    @cached_property
    def _until_touch(self) -> Float:
        return motion_until_touch(self.problem, self.state, self.move)

    def geometry(self, displacement: Float, within: float = _NEAR) -> ContactGeometry:
        """Return the contact geometry at the end of the increment, at a displacement (c, d).

        It is exact for points nearer to the object than `within`, over the depth.
        """
        problem, reach = self.problem, within * length_scale(self.problem, self.move)
        placed, object_share = problem.placed(self.move.end), problem.system.object_share

        def distance(points: Float) -> tuple[Float, Float]:
            return self.tracker.distance(placed, points, reach)

        return contact_geometry(distance, problem.surface, displacement, problem.axes, object_share)

    def solve(self, guess: Float | None) -> ContactSolution[State[Float]]:
        """Return the solution at the end of the increment, whose motion, where it is unknown, its state has."""
        problem, state, body, increment = self.problem, self.state, self.body, self
        if self._moves_too_far:
            return ContactSolution(state, Outcome.PASSED_THROUGH, np.inf, 0, "none")
        flat = problem.model.object.is_flat
        expansion_point = np.zeros_like(body.past)
        if not flat:
            expected = state.contact.force if guess is None else guess
            expansion_point = body.displacement(expected, state.contact.own_bases)
        geometry = self.geometry(expansion_point)
        held = np.zeros(len(expansion_point), dtype=bool)
        spent, error, start = 0, np.inf, guess
        tried: list[Float] = []
        displacements: list[Float] = []
        settled = 0
        for _ in range(_MOST_SOLUTIONS):
            before = increment
            increment, solution = before.solve_linearised(geometry, expansion_point, start)
            spent += solution.iterations
            if not (solution.outcome.ok or solution.outcome.is_cycle):
                return replace(solution.with_state(state), iterations=spent)
            start = solution.state.force
            displacement, apart = body.displacement(start, geometry.bases), increment.distance_from(before)
            if flat or solution.outcome.is_cycle:
                error = apart
                if error <= _TARGET:
                    break
                geometry = increment.geometry(expansion_point)
                continue
            for within in (_NEAR, np.inf):  # means over points of which some are far need exact distances in the end
                after = increment.geometry(displacement, within).holding(held, geometry)
                error = max(increment.error(after, after.angles(geometry), displacement, solution.state), apart)
                if error > _TARGET:
                    break
            if error <= _TARGET:
                break
            settled += apart <= _HOLD_ABOVE
            if settled >= _HOLD_FROM:
                change = np.linalg.norm(after.gradient - geometry.gradient, axis=1)
                held |= (change > _HOLD_ABOVE) & (start[:, 0] > 0.0)
            # as seen from the object, which may have been moved
            seen = expansion_point - before.moved_from(self), displacement - increment.moved_from(self)
            tried, displacements = [*tried, seen[0]][-_MEMORY:], [*displacements, seen[1]][-_MEMORY:]
            expansion_point, following = displacement, after
            if len(tried) > 1:
                ends = [one.ravel() for one in displacements]
                steps = [(end - one.ravel()) for end, one in zip(ends, tried, strict=True)]
                expansion_point = accelerated(ends, steps, _SAME).reshape(displacement.shape)
                expansion_point += increment.moved_from(self)
                following = increment.geometry(expansion_point)
            geometry = following.holding(held, geometry)
        if error > TOLERANCE:
            return ContactSolution(state, Outcome.NO_CONVERGENCE, float(error), spent, "none")
        gap = None
        if not (flat and increment is self):
            gap = increment.geometry(displacement, np.inf).holding(held, geometry).gap
        after_state = increment.reached(geometry, expansion_point, displacement, solution.state, gap)
        through = passes_through(problem, increment.move, state.body, displacement, state.contact.gap)
        through |= increment is not self and increment._moves_too_far
        if through or pulls(problem, state.contact, after_state.contact, increment.move):
            return ContactSolution(state, Outcome.PASSED_THROUGH, float(error), spent, "none")
        return replace(solution.with_state(after_state), residual=max(solution.residual, error), iterations=spent)

    @property
    def _moves_too_far(self) -> bool:
        carried = carried_by_object(self.problem, self.move, self.state.body)
        return moves_too_far(self.problem, self.move, self.state.contact.gap, carried)

    def moved_from(self, other: Increment) -> Float:
        """Return the displacement (c, d) mm of the object, where the points are at rest, from another end."""
        return carried_by_object(self.problem, Move(other.move.end, self.move.end), np.zeros_like(self.body.past))

    def distance_from(self, other: Increment) -> float:
        """Return the distance of the ends of two motions, over the depth."""
        apart = float(np.abs(self.moved_from(other)).max(initial=0.0)) if self is not other else 0.0
        return apart / length_scale(self.problem, self.move)

    def solve_linearised(
        self, geometry: ContactGeometry, expansion_point: Float, guess: Float | None
    ) -> tuple[Self, ContactSolution[ContactState]]:
        """Solve contact with the gaps linearised at a displacement (c, d); far points cannot touch."""
        problem, bases = self.problem, geometry.bases
        d = bases.shape[-1]
        start = transported(self.state.contact, bases)
        free_displacement = self.relative(geometry, expansion_point, self.body.past @ vertical_frame(d))
        free_displacement[:, 1:] += start.tangential_displacement
        scale, area = length_scale(problem, self.move), problem.surface.area
        law = problem.model.friction
        rotations = geometry.from_reference
        if (rotations == np.eye(d)).all():
            contact = ContactProblem.of(start, free_displacement, self.body.delassus, law, scale, area=area)
            return self._solved(contact, guess, bases, problem.surface.centroids + expansion_point)
        expected = start.force if guess is None else guess
        near = np.flatnonzero((geometry.gap < 2.0 * _NEAR * scale) | (expected[:, 0] > 0.0))
        delassus = rotated_delassus(self.body.delassus, rotations[near], near)
        touched = start.of_points(near)
        contact = ContactProblem.of(touched, free_displacement[near], delassus, law, scale, area[near])
        at = problem.surface.centroids[near] + expansion_point[near]
        increment, part = self._solved(contact, expected[near], bases[near], at)
        force, status = np.zeros_like(expected), np.full(len(expected), OPEN, dtype=np.int8)
        force[near], status[near] = part.state.force, part.state.status
        return increment, replace(part, state=replace(start, force=force, status=status))

    def _solved(
        self, contact: ContactProblem, guess: Float | None, bases: Float, at: Float
    ) -> tuple[Self, ContactSolution[ContactState]]:
        """Return the contact solution of points at (k, d) mm, with bases (k, d, d), and the increment it is for."""
        return self, RULES[self.problem.model.rule](contact, guess)

    def relative(self, geometry: ContactGeometry, expansion_point: Float, displacement: Float) -> Float:
        """Return gap and slip (c, d) mm of the increment at a displacement, the gap linearised at another one.

        Points that close in the increment slip from where they touch.
        """
        bases = geometry.bases
        out: Float = np.einsum("cak,ck->ca", bases, displacement - expansion_point)
        out[:, 0] += geometry.gap
        slid = displacement - self.state.body - carried_by_object(self.problem, self.move, expansion_point)
        slid = slid - self._until_touch
        out[:, 1:] = np.einsum("ctk,ck->ct", bases[:, 1:], slid)
        return out

    def error(self, after: ContactGeometry, turned: Float, displacement: Float, contact: ContactState) -> float:
        """Return the largest violation by gaps at the displacement found, and by directions that have turned.

        Gaps are divided by the depth; turns (c,) rad count by the force of their point over the largest.
        """
        scale = length_scale(self.problem, self.move)
        closed = contact.status != OPEN
        gap = np.where(closed, np.abs(after.gap), np.maximum(-after.gap, 0.0)) / scale
        size = np.linalg.norm(contact.force, axis=1)
        return float(max(gap.max(initial=0.0), (turned * size).max(initial=0.0) / (size.max(initial=0.0) or 1.0)))

    def reached(
        self,
        geometry: ContactGeometry,
        expansion_point: Float,
        displacement: Float,
        contact: ContactState,
        gap: Float | None,
    ) -> State[Float]:
        """Return the state at the end of the increment, with gaps (c,) or those linearised at a displacement."""
        relative = self.relative(geometry, expansion_point, displacement)
        if gap is not None:
            relative[:, 0] = gap
        reached = advanced(self.state, replace(contact, bases=geometry.bases), relative, self._until_touch, self.move)
        return replace(reached, body=displacement)


@dataclass(frozen=True)
class IncrementToForces(Increment):
    """An increment to prescribed forces, with as many coordinates of its end as more unknowns of the iteration.

    Attributes
    ----------
    wanted : on the whole finger
    is_exact : whether the end has the forces, and the gaps there are not linearised
    """

    wanted: GeneralisedForces
    is_exact: bool = False

    def distance_from(self, other: Increment) -> float:
        """Return the distance of the ends of two motions, over the depth; none where the linearised gaps are exact."""
        return 0.0 if self.is_exact else super().distance_from(other)

    def _solved(
        self, contact: ContactProblem, guess: Float | None, bases: Float, at: Float
    ) -> tuple[Self, ContactSolution[ContactState]]:
        """Move the object until the points have the forces; no further than distances are exact."""
        problem, end, wanted = self.problem, self.move.end, self.wanted
        images = 2.0 ** len(problem.axes)
        design, is_flat = problem.model.design, problem.model.object.is_flat
        far, arm = design.height_mm if is_flat else _NEAR * length_scale(problem, self.move), design.height_mm
        size = bases[:, 0].size, len(wanted.numbers)
        motion, resultant = (
            -np.einsum("cak,ckj->caj", bases, field(problem, end, at, wanted.numbers)).reshape(size)
            for field in (motions, resultants)
        )
        conditions = wanted.conditions(motion, resultant, images, (far, arm), _EXACT)
        solution, moved, lacking = solve_to_forces(problem.model.rule, contact, guess, conditions)
        solution = wanted.checked(solution, bases, images, lacking)
        missed = np.abs(conditions.missing(solution.state.force) / conditions.scale).max()
        is_exact = is_flat and max(wanted.numbers) < 3 and float(missed) <= _EXACT
        return replace(self, move=Move(self.move.start, wanted.moved(end, moved)), is_exact=is_exact), solution


def increment_of(
    problem: Problem,
    state: State[Float],
    move: Move,
    body: LinearBody,
    workspace: Workspace,
    wanted: GeneralisedForces | None = None,
) -> Increment:
    """Return the increment from a state as the object moves, or to forces that are wanted.

    Its solution's state of the body is the displacement (c, d) mm of the contact points.  It is CONVERGED only if gaps
    and directions at the displacement found agree with those that the forces were solved with.
    """
    if wanted is None:
        return Increment(problem, state, move, body, workspace.tracker)
    return IncrementToForces(problem, state, move, body, workspace.tracker, wanted)


def motion_until_touch(problem: Problem, state: State[Any], move: Move) -> Float:
    """Return the motion (c, d) mm of open points until they touch; zero in a press that its increments define."""
    if problem.model.is_defined_by_increments:
        return np.zeros_like(state.contact.force)
    return state.motion_until_touch(move)


def advanced(state: State[B], contact: ContactState, relative: Float, until_touch: Float, move: Move) -> State[B]:
    """Return a state after an increment, with the body as it was.

    Parameters
    ----------
    contact : ContactState
        Forces, status and bases at the end.
    relative : (c, d) mm
        Gap at the end, and slip since the point touched if it closes in the increment.
    until_touch : (c, d) mm
        Tangential motion before, see `motion_until_touch`.
    """
    start, moved, opened = transported(state.contact, contact.own_bases), relative.copy(), contact.status == OPEN
    moved[opened, 1:] += np.einsum("ctk,ck->ct", contact.own_bases[opened, 1:], until_touch[opened])
    after = replace(next_state(start, contact.force, moved, contact.status), bases=contact.bases)
    change = np.column_stack([after.gap - start.gap, after.tangential_displacement - start.tangential_displacement])
    return State(after, state.body, (move, change))


def transported(state: ContactState, bases: Float) -> ContactState:
    """Return a state whose tangential vectors (c, d - 1) are expressed in other bases (c, d, d)."""
    if state.bases is None or state.bases is bases or (state.bases == bases).all():
        return state
    turn = np.einsum("ctk,csk->cts", bases[:, 1:], state.bases[:, 1:])
    force = state.force.copy()
    force[:, 1:] = np.einsum("cts,cs->ct", turn, state.force[:, 1:])
    return replace(
        state,
        force=force,
        tangential_displacement=np.einsum("cts,cs->ct", turn, state.tangential_displacement),
        accumulated_slip=np.einsum("cts,cs->ct", turn, state.accumulated_slip),
        bases=bases,
    )


def carried_by_object(problem: Problem, move: Move, displacement: Float) -> Float:
    """Return how far (c, d) mm the object moves where the points are, displaced by `displacement` (c, d).

    The displacement of a point is the mean over its hat function; the mean of a turn is that of the centroid.
    """
    d, start, end = displacement.shape[1], move.start, move.end
    if start.turns == end.turns and problem.system.second is None:
        return np.broadcast_to((end.displacement - start.displacement)[:d], displacement.shape)
    points = in_space(problem.surface.centroids + displacement)
    return problem.placed(end).moved_from(problem.placed(start), points)[:, :d]


@dataclass(frozen=True)
class SmallStrain:
    """Linear elasticity over the condensed compliance.

    The state of the body is the displacement (c, d) mm of the contact points, in x, y, z.
    """

    def workspace(self) -> Workspace:
        """Return an empty workspace; the compliance is that of the build."""
        return Workspace()

    def start(self, problem: Problem) -> State[Float]:
        """Return the state without forces, with the gaps at rest."""
        return State(at_rest(problem), np.zeros_like(problem.surface.points))

    def increment(
        self,
        problem: Problem,
        state: State[Float],
        move: Move,
        guess: Float | None,
        workspace: Workspace,
        wanted: GeneralisedForces | None = None,
    ) -> ContactSolution[State[Float]]:
        """Solve contact along the normals of the object."""
        body = LinearBody(problem.delassus, np.zeros_like(state.body))
        return increment_of(problem, state, move, body, workspace, wanted).solve(guess)

    def unknowns(self, problem: Problem, states: Sequence[State[Float]]) -> Iterator[Float]:
        """Yield the unknowns from the forces, by one back-substitution for many states."""
        return problem.unknowns_of([problem.upright_force(state.contact) for state in states])

    def readings(self, problem: Problem, state: State[Float]) -> dict[Column, float]:
        """Return the readings from the forces, by their rows."""
        return problem.read(problem.upright_force(state.contact))

    def loads(self, problem: Problem, state: State[Float], pose: ObjectPose) -> Loads:
        """Return the forces of the points, at their centroids at rest."""
        return linear_loads(problem, state.contact, state.body)

    def gap(self, problem: Problem, u: Float, pose: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Return gaps and normals at the displaced points."""
        return linear_gap(problem, u, pose, surface)

    def fields(self, problem: Problem, state: State[Float]) -> tuple[Float, Float, Float]:
        """Return displacement, linear strain and stress; in a section also the out-of-plane components."""
        unknowns = next(self.unknowns(problem, [state]))
        return displacement(problem.mesh, unknowns), *problem.strain_and_stress(unknowns)


def at_rest(problem: Problem) -> ContactState:
    """Return the contact state without forces, with the gaps at rest."""
    distance, object_share = problem.placed(problem.origin).distance, problem.system.object_share
    geometry = contact_geometry(distance, problem.surface, axes=problem.axes, object_share=object_share)
    return replace(ContactState.at_rest(geometry.gap, problem.dim), bases=geometry.bases)


def linear_loads(problem: Problem, contact: ContactState, moved: Float) -> Loads:
    """Return the forces of the contact points, which are displaced by `moved` (c, d), at their centroids at rest."""
    return Loads(problem.surface.centroids, moved, contact.scene_force, at_rest=True)


def linear_gap(problem: Problem, u: Float, pose: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
    """Return gaps (c,) and normals (c, d) of the points of a surface at small nodal displacements u (n, d)."""
    geometry = contact_geometry(problem.placed(pose).distance, surface, surface.trace @ u, problem.axes)
    return geometry.gap, geometry.bases[:, 0]
