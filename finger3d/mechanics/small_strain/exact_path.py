"""Press of a section by a flat object in small strain: the exact path between two poses, from event to event."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from finger3d._types import Float
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.events import Event, Resultant, follow
from finger3d.contact.friction import Coulomb
from finger3d.contact.state import ContactSolution, ContactState
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


class PathSolution(NamedTuple):
    """Solution of a path between two poses.

    Attributes
    ----------
    solution : at its end, or why it cannot be followed
    pose : at its end, with the depth that was found under a prescribed force
    energies : work of the object and dissipation (mJ) on the way
    events : number of events on the way
    """

    solution: ContactSolution[State[Float]]
    pose: ObjectPose
    energies: tuple[float, float]
    events: int


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
        and not any(leg.turn_x or leg.turn_y or leg.turn_z for leg in model.legs)
    )


def ends_only(problem: Problem) -> Problem:
    """Return the problem with one station a leg where its path is exact, as only the ends are wanted; else as it is."""
    if not has_exact_path(problem.model):
        return problem
    legs = tuple(replace(leg, steps=1) for leg in problem.model.legs)
    return replace(problem, model=replace(problem.model, legs=legs))


def solve_path(problem: Problem, state: State[Float], move: Move, force: NormalForce | None = None) -> PathSolution:
    """Advance a state as the object moves straight from one pose to another.

    Under a prescribed force the depth at the end of the move is not used.
    """
    if force is not None:
        move = Move(move.start, replace(move.end, depth_mm=move.start.depth_mm))
    body = LinearBody(problem.delassus, np.zeros_like(state.body))
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
    found, events = follow(contact, resultant)
    if not found.outcome.ok:
        detail = found.detail
        if found.outcome is Outcome.EVENTS:
            detail = _place_of_change(problem, events)
        elif force and found.outcome is Outcome.FORCE_NOT_REACHED:
            detail = _shortfall(force, move, events)
        return PathSolution(replace(found.with_state(state), detail=detail), move.start, (0.0, 0.0), len(events))
    after = State(replace(found.state, bases=bases), body.displacement(found.state.force, bases))
    pose = replace(move.end, depth_mm=move.end.depth_mm + events[-1].amplitude)
    energies = _energies(problem, count, start, bases, move, events)
    return PathSolution(found.with_state(after), pose, energies, len(events))


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


def _energies(
    problem: Problem, count: Float, start: ContactState, bases: Float, move: Move, events: list[Event]
) -> tuple[float, float]:
    """Return work and dissipation (mJ), exact since forces are linear between events.

    What forces on points lose that move relative to the object is dissipated, in slip and where forces jump.
    """
    states = [start, *(event.state for event in events)]
    forces = np.stack([state.force for state in states])
    mean = 0.5 * (forces[1:] + forces[:-1]) * count[:, None]
    relative = np.stack([np.column_stack([state.gap, state.tangential_displacement]) for state in states])
    resultants = np.einsum("eca,cak->ek", mean, bases)
    if "x" in problem.axes:  # the halves of a mirrored finger cancel
        resultants[:, 0] = 0.0
    shares = np.diff([0.0, *(event.share for event in events)])
    depths = np.diff([0.0, *(event.amplitude for event in events)])
    way = shares[:, None] * (move.end.displacement - move.start.displacement)[: forces.shape[2]]
    way[:, 1] -= depths
    return float(np.sum(resultants * way)), -float(np.sum(mean * np.diff(relative, axis=0)))
