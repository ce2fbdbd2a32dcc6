"""Formulation of the body, its strain measure and material response: the interface that effects implement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.rules import RULES
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.mechanics.cost import AddedCost, PressCost
from finger3d.objects import DistanceTracker

if TYPE_CHECKING:
    from finger3d.fem.traces import BoundarySurface
    from finger3d.mechanics.model import Model
    from finger3d.mechanics.problem import Problem
    from finger3d.mechanics.relaxation import Relaxation
    from finger3d.objects import ObjectPose


@dataclass
class Workspace:
    """Factors and sparsity patterns that one increment leaves for the next; formulations add fields of their own.

    Several presses of one problem may share a workspace in turn, but not at once.

    Attributes
    ----------
    factorizations : number of factorisations made with this workspace
    tracker : distances of the finger's surface from the object
    known : solution of the next increment, if it has been found already together with those of other presses
    """

    factorizations: int = 0
    tracker: DistanceTracker = field(default_factory=DistanceTracker)
    known: ContactSolution | None = None


class Formulation(Protocol):
    """Strain measure and material response of the body during a press.

    Attributes
    ----------
    finite_strain : bool
        Whether the strain measure is that of finite deformation.
    is_linear_elastic : bool
        Whether strain is linear and the displacements follow from the present contact forces alone.
    refactorises : bool
        Whether increments factor the stiffness again; presses of such a body run one after another.
    """

    @property
    def finite_strain(self) -> bool: ...

    @property
    def is_linear_elastic(self) -> bool: ...

    @property
    def refactorises(self) -> bool: ...

    def relaxing(self, relaxation: Relaxation) -> Formulation:
        """Return the formulation of a body whose moduli relax."""
        ...

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return the cost that the formulation adds to that of small-strain elasticity."""
        ...

    def state_size(self, press: PressCost) -> float:
        """Return how many numbers a state holds besides those of its contact points."""
        ...

    def workspace(self) -> Workspace:
        """Return an empty workspace for `increment`."""
        ...

    def start(self, problem: Problem) -> ContactState:
        """State at rest, before the first increment."""
        ...

    def increment(
        self,
        problem: Problem,
        state: ContactState,
        a: ObjectPose,
        b: ObjectPose,
        guess: Float | None,
        workspace: Workspace,
    ) -> ContactSolution:
        """Advance a state from pose a to pose b of the object.

        Parameters
        ----------
        guess : (c, d) array, N, optional
            Contact forces where the iteration starts; those of `state` unless given.
        workspace : Workspace
            What `workspace` of this formulation returned; the increment may change it.
        """
        ...

    def unknowns(self, problem: Problem, state: ContactState) -> Float:
        """All unknowns (N,) of the meshed part in a state."""
        ...

    def all_unknowns(self, problem: Problem, states: Sequence[ContactState]) -> Iterator[Float]:
        """Yield the unknowns of each of several states, which may cost less than one after another."""
        ...

    def readings(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Every number that is read, by its name in `Model.reading_names`."""
        ...

    def work_on_body(
        self, problem: Problem, before: ContactState, after: ContactState, a: ObjectPose, b: ObjectPose
    ) -> float:
        """Work (mJ) of the contact forces on the meshed part from one state to the next."""
        ...

    def moment(self, problem: Problem, state: ContactState, target: ObjectPose) -> Float:
        """Moment (3,) N mm of the contact forces on the meshed part about the middle of the base."""
        ...

    def acting_places(self, problem: Problem, state: ContactState) -> Float:
        """Places (c, d) mm where the forces of the contact points act: means over their hat functions."""
        ...

    def gap(self, problem: Problem, u: Float, target: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Gap (c,) mm and normal (c, d) of any points of the surface, candidates or not, at nodal displacements."""
        ...

    def may_touch(self, surface: BoundarySurface, normal: Float) -> NDArray[np.bool_]:
        """Which points (c,) of a surface can touch an object with normals (c, d) there."""
        ...

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Displacement (n, d) mm, strain (n, 3, 3) and stress (n, 3, 3) MPa at the nodes of the meshed part."""
        ...


def moment_of(places: Float, forces: Float) -> Float:
    """Return the moment (3,) N mm about the origin of forces (n, d) N at places (n, d) mm."""
    arms, loads = (np.pad(v, ((0, 0), (0, 3 - v.shape[1]))) for v in (places, forces))
    return np.asarray(np.cross(arms, loads).sum(axis=0))


def length_scale(problem: Problem, a: ObjectPose, b: ObjectPose) -> float:
    """Return the length (mm) that gaps are divided by: the depth, or that of the deepest leg during release.

    It is that of the deepest leg, too, while the object is turned: the depth is that of the point which was lowest.
    """
    depth = 0.0 if a.is_turned or b.is_turned else max(a.depth_mm, b.depth_mm)
    return depth if depth > 0.0 else problem.model.largest_depth_mm


def solve_contact(
    problem: Problem,
    state: ContactState,
    free: Float,
    compliance: Float,
    scale: float,
    guess: Float | None,
    weights: Float | None = None,
    points: NDArray[np.intp] | None = None,
) -> ContactSolution:
    """Solve one increment by the model's stick rule and friction law; see `finger3d.contact.solve.solve_increment`.

    `points` (k,) are the contact points that the arguments belong to, all unless given.
    """
    model, area = problem.model, problem.surface.area
    own = area if points is None else area[points]
    return RULES[model.rule](state, free, compliance, model.friction, scale, guess, weights, own)
