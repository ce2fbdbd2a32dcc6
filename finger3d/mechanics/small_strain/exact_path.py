"""Press of a section by a flat object in small strain: the exact path between two poses, from event to event."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from finger3d._types import Float
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.events import Resultant, follow
from finger3d.contact.friction import Coulomb
from finger3d.contact.state import ContactSolution, ContactState, Event
from finger3d.errors import Outcome
from finger3d.fem.tensors import rotated_delassus
from finger3d.mechanics.discretise.contact_geometry import contact_geometry
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import length_scale
from finger3d.mechanics.model import Model
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.linear_contact import LinearBody, transported
from finger3d.objects import Move, ObjectPose, vertical_frame


@dataclass(frozen=True)
class NormalForce:
    """Normal force (N) at the ends of a path, between which it changes in proportion; the depth follows from it.

    Attributes
    ----------
    start, end : N
    largest_depth_mm : at which the search for the force ends
    """

    start: float
    end: float
    largest_depth_mm: float


@dataclass(frozen=True)
class PathPoint:
    """Place on a path, and what led there from an earlier one.

    Attributes
    ----------
    solution : state, and the largest residual on the way; or why the path does not lead there
    pose : with the depth that was found under a prescribed force
    energies : work of the object and dissipation (mJ) on the way
    """

    solution: ContactSolution[State[Float]]
    pose: ObjectPose
    energies: tuple[float, float]


@dataclass(frozen=True)
class ExactPath:
    """Path between two poses, followed from event to event.

    Attributes
    ----------
    problem : Problem
    move : from its start to its end; under a prescribed force without the change of depth
    start : Event
    events : in order, up to the end or to where the path could not be continued
    bases : (c, d, d), directions of the points
    count : (c,), number of points of the whole finger that each stands for
    outcome, detail : of the whole path
    """

    problem: Problem
    move: Move
    start: Event
    events: list[Event]
    bases: Float
    count: Float
    outcome: Outcome
    detail: str

    def between(self, first: float, last: float) -> PathPoint:
        """Return the place at the share `last` of the path, reached from that at `first`."""
        begin, passed = self.at(first)
        if last > (self.events[-1].share if self.events else -1.0):
            state = self._state(begin.state)
            solution = ContactSolution(state, self.outcome, np.inf, 0, "none", self.detail)
            return PathPoint(solution, self.pose(begin), (0.0, 0.0))
        end, done = self.at(last)
        way = [begin, *self.events[passed:done], end]
        crossed = self.events[passed : done + 1]
        residual = max((event.residual for event in crossed), default=0.0)
        systems = end.systems - begin.systems
        solution = ContactSolution(self._state(end.state), Outcome.CONVERGED, residual, systems, "events")
        return PathPoint(solution, self.pose(end), self.energies(way))

    def at(self, share: float) -> tuple[Event, int]:
        """Return the state at a share as an event, and the number of events up to there."""
        done = bisect_right(self.events, share, key=lambda event: event.share)
        before = self.events[done - 1] if done else self.start
        if done == len(self.events) or before.share == share:
            return before, done
        after = self.events[done]
        t = (share - before.share) / (after.share - before.share)
        amplitude = before.amplitude + t * (after.amplitude - before.amplitude)
        return Event(share, amplitude, before.state.towards(after.state, t), after.residual, after.systems), done

    def _state(self, contact: ContactState) -> State[Float]:
        body = LinearBody(self.problem.delassus, np.zeros(self.bases.shape[:2]))
        return State(replace(contact, bases=self.bases), body.displacement(contact.force, self.bases))

    def pose(self, event: Event) -> ObjectPose:
        """Return the pose of the object at a place."""
        pose = self.move.end if event.share == 1.0 else self.move.at(event.share)
        return replace(pose, depth_mm=pose.depth_mm + event.amplitude)

    def energies(self, events: Sequence[Event]) -> tuple[float, float]:
        """Return work and dissipation (mJ) from first to last event, exact since forces are linear between events.

        What forces on points lose that move relative to the object is dissipated, in slip and where forces jump.
        """
        states = [event.state for event in events]
        forces = np.stack([state.force for state in states])
        mean = 0.5 * (forces[1:] + forces[:-1]) * self.count[:, None]
        relative = np.stack([np.column_stack([state.gap, state.tangential_displacement]) for state in states])
        resultants = np.einsum("eca,cak->ek", mean, self.bases)
        if "x" in self.problem.axes:  # the halves of a mirrored finger cancel
            resultants[:, 0] = 0.0
        shares, depths = (np.diff([getattr(event, name) for event in events]) for name in ("share", "amplitude"))
        way = shares[:, None] * (self.move.end.displacement - self.move.start.displacement)[: forces.shape[2]]
        way[:, 1] -= depths
        return float(np.sum(resultants * way)), -float(np.sum(mean * np.diff(relative, axis=0)))


def has_exact_path(model: Model) -> bool:
    """Whether contact can be solved without increments.

    Forces are then piecewise linear in the motion of the object: the body is a section and linear elastic, the object
    flat and never turned, and friction has one constant coefficient.  Other rules than the projection are defined by
    their increments.
    """
    return (
        model.domain != "solid"
        and model.is_linear_elastic
        and model.object.is_flat
        and type(model.friction) is Coulomb
        and model.rule == "projection"
        and not any(leg.turn_x or leg.turn_y or leg.turn_z or leg.force_x_N is not None for leg in model.legs)
    )


def solve_path(
    problem: Problem,
    state: State[Float],
    move: Move,
    force: NormalForce | None = None,
    shares: Sequence[float] = (),
) -> ExactPath:
    """Follow the path on which the object moves straight from one pose to another.

    Under a prescribed force the depth at the end of the move is not used.  Where forces jump, states are those of
    increments, none of which goes past one of the shares of the path at which results are wanted.
    """
    if force is not None:
        move = Move(move.start, replace(move.end, depth_mm=move.start.depth_mm))
    d = state.body.shape[1]

    def free_displacement(pose: ObjectPose) -> tuple[Float, Float]:
        """Gap and tangential displacement (c, d) without forces since the start, and the directions of the points."""
        found = contact_geometry(
            problem.placed(pose).distance,
            problem.surface,
            axes=problem.axes,
            object_share=problem.system.object_share,
        )
        carried = (pose.displacement - move.start.displacement)[:d]
        moved = -_along(found.bases, state.body + carried)
        return np.column_stack([found.gap, moved]), found.bases

    free, bases = free_displacement(move.end)
    start = transported(state.contact, bases)
    free[:, 1:] += start.tangential_displacement
    rotations = bases @ vertical_frame(d).T
    delassus = problem.delassus
    if not (rotations == np.eye(d)).all():
        delassus = rotated_delassus(delassus, rotations, np.arange(len(delassus)))
    scale, law = length_scale(problem, move), problem.model.contact_law
    contact = ContactProblem.of(start, free, delassus, law, scale, area=problem.surface.area)
    count: Float = np.bincount(problem.symmetry.image_of, problem.symmetry.multiplicity, len(free)).astype(np.float64)
    resultant = None
    if force is not None:
        deeper = free_displacement(replace(move.end, depth_mm=move.end.depth_mm + 1.0))[0]
        deeper[:, 1:] += start.tangential_displacement
        resultant = Resultant(
            weights=-count[:, None] * bases[:, :, 1],
            start=force.start,
            end=force.end,
            motion=deeper - free,
            largest=force.largest_depth_mm - move.start.depth_mm,
        )
    found, events = follow(contact, resultant, shares)
    detail = found.detail
    if found.outcome is Outcome.EVENTS:
        detail = _place_of_change(problem, events)
    elif force and found.outcome is Outcome.FORCE_NOT_REACHED:
        detail = _shortfall(force, move, events)
    begin = Event(0.0, 0.0, start, 0.0, 0)
    return ExactPath(problem, move, begin, events, bases, count, found.outcome, detail)


def _place_of_change(problem: Problem, events: list[Event]) -> str:
    """Return where the status of a point changed last."""
    last, before = (event.state.status for event in (events[-1], events[-2]))
    points = problem.surface.points[np.flatnonzero(last != before)]
    return ", ".join(f"x = {x:.4g} mm" for x in points[:1, 0])


def _shortfall(force: NormalForce, move: Move, events: list[Event]) -> str:
    """Return how much of a force was reached, and at which depth."""
    if not events or not events[-1].share:
        return f"{force.end:.6g} N asked; the object does not touch the finger down to {force.largest_depth_mm:.4g} mm"
    reached = force.start + events[-1].share * (force.end - force.start)
    depth = move.start.depth_mm + events[-1].amplitude
    return f"{force.end:.6g} N asked; the largest force is {reached:.6g} N, at a depth of {depth:.4g} mm"


def _along(bases: Float, displacement: Float) -> Float:
    """Return the tangential components (c, d - 1) of displacements (c, d)."""
    return np.asarray(np.einsum("ctk,ck->ct", bases[:, 1:], displacement))
