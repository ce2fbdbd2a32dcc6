"""Formulation of the body: the interface of what advances it by an increment, and what all formulations share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE
from finger3d.contact.state import ContactSolution
from finger3d.fem.surface import BoundarySurface
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.generalised import GeneralisedForces
from finger3d.mechanics.history import B, State
from finger3d.mechanics.readings import Column
from finger3d.objects import DistanceTracker, Move, ObjectPose
from finger3d.progress import QUIET, Progress

W = TypeVar("W", bound="Workspace")

_ROUND_OFF = 20.0 * np.finfo(float).eps
"""Round-off of coordinates, over the height of the finger."""


@dataclass
class Workspace:
    """What the increments of a press share: factors, sparsity patterns, progress; formulations add fields of their own.

    Several presses of one problem may share a workspace in turn, but not at once.

    Attributes
    ----------
    factorizations : number of factorisations made with this workspace
    tracker : distances of the finger's surface from the object
    report : receives remarks on parts of an increment
    """

    factorizations: int = 0
    tracker: DistanceTracker = field(default_factory=DistanceTracker)
    report: Progress = QUIET


class Loads(NamedTuple):
    """Forces on the body, as their work and their moment need them.

    Attributes
    ----------
    places : (k, d) mm, where they act
    displacement : (k, d) mm, there
    force : (k, d) N
    at_rest : whether the places are those at rest, as in small strain
    """

    places: Float
    displacement: Float
    force: Float
    at_rest: bool = False

    @property
    def moment(self) -> Float:
        """Moment (3,) N mm about the middle of the base."""
        products = np.zeros((3, 3))
        products[: self.force.shape[1], : self.force.shape[1]] = self.places.T @ self.force
        return np.array([products[i, j] - products[j, i] for i, j in ((1, 2), (2, 0), (0, 1))])

    @property
    def forces(self) -> tuple[Float, Float]:
        """Places of the displaced body, and the forces there."""
        return self.places + self.displacement if self.at_rest else self.places, self.force

    def work_from(self, before: Loads) -> float:
        """Work (mJ) since other loads of the same points, by the trapezoidal rule."""
        return float(np.sum(0.5 * (before.force + self.force) * (self.displacement - before.displacement)))


class Formulation(Protocol[B, W]):
    """Strain measure and material response of the body during a press; B is the state of the body."""

    def workspace(self) -> W:
        """Return an empty workspace for `increment`."""
        ...

    def start(self, problem: Problem) -> State[B]:
        """Return the state at rest, before the first increment."""
        ...

    def increment(
        self,
        problem: Problem,
        state: State[B],
        move: Move,
        guess: Float | None,
        workspace: W,
        wanted: GeneralisedForces | None = None,
    ) -> ContactSolution[State[B]]:
        """Advance a state as the object moves.

        Parameters
        ----------
        guess : (c, d) array, N, optional
            Contact forces where the iteration starts; those of `state` unless given.
        workspace : Workspace
            What `workspace` of this formulation returned; the increment may change it.
        wanted : GeneralisedForces, optional
            Forces at the end, with as many coordinates of the pose as unknowns of the iteration, which begins at that
            of `move`.  The state has the motion that is found; where no pose has the forces, those nearest to them.
        """
        ...

    def unknowns(self, problem: Problem, states: Sequence[State[B]]) -> Iterator[Float]:
        """Yield all unknowns (N,) of the meshed part in each of several states, which may cost less than one by one."""
        ...

    def readings(self, problem: Problem, state: State[B]) -> dict[Column, float]:
        """Return every number that is read, by its column."""
        ...

    def loads(self, problem: Problem, state: State[B], pose: ObjectPose) -> Loads:
        """Return the contact forces on the meshed part, with their places."""
        ...

    def gap(self, problem: Problem, u: Float, pose: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Return gap (c,) mm and normal (c, d) of any points of the surface, candidates or not, at displacements u."""
        ...

    def fields(self, problem: Problem, state: State[B]) -> tuple[Float, Float, Float]:
        """Return displacement (n, d) mm, strain (n, 3, 3) and stress (n, 3, 3) MPa at the nodes of the meshed part."""
        ...


def length_scale(problem: Problem, move: Move) -> float:
    """Return the length (mm) that gaps are divided by: the depth, or that of the deepest leg during release.

    It is that of the deepest leg, too, while the object is turned: the depth is that of the point which was lowest.
    It is never so small that the round-off of coordinates would count as a violation of the contact conditions.
    """
    poses = move.start, move.end
    depth = 0.0 if any(pose.is_turned for pose in poses) else max(pose.depth_mm for pose in poses)
    resolved = _ROUND_OFF * problem.model.design.height_mm / TOLERANCE
    return max(depth, resolved) if depth > 0.0 else problem.model.largest_depth_mm
