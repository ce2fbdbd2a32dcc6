"""Small-strain elasticity over the condensed compliance: the paper's baseline, which effects replace or wrap."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.mechanics.contact_geometry import contact_geometry, may_touch
from finger3d.mechanics.cost import AddedCost, PressCost
from finger3d.mechanics.formulation import Workspace, moment_of
from finger3d.mechanics.linear_contact import LinearBody, LinearState, solve_increment

if TYPE_CHECKING:
    from finger3d.fem.traces import BoundarySurface
    from finger3d.mechanics.formulation import Formulation
    from finger3d.mechanics.model import Model
    from finger3d.mechanics.problem import Problem
    from finger3d.mechanics.relaxation import Relaxation
    from finger3d.objects import ObjectPose


@dataclass(frozen=True)
class SmallStrain:
    """Linear elasticity over the condensed compliance: the paper's baseline."""

    finite_strain: ClassVar[bool] = False
    is_linear_elastic: ClassVar[bool] = True

    def relaxing(self, relaxation: Relaxation) -> Formulation:
        """Return the formulation of a relaxing body in small strain."""
        return relaxation.small_strain()

    @property
    def refactorises(self) -> bool:
        """False: the factor of the build serves every increment."""
        return False

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return zero cost."""
        return AddedCost()

    def state_size(self, press: PressCost) -> float:
        """Return 0: the contact forces determine the displacements."""
        return 0.0

    def workspace(self) -> Workspace:
        """Return an empty workspace; the compliance is that of the build."""
        return Workspace()

    def start(self, problem: Problem) -> LinearState:
        """Return the state without forces, with the gaps at rest."""
        distance, share = problem.placed(problem.origin).distance, problem.system.object_share
        geometry = contact_geometry(distance, problem.surface, axes=problem.axes, share=share)
        rest = ContactState.at_rest(geometry.gap, problem.dim)
        still = np.zeros_like(problem.surface.points)
        return LinearState(**(vars(rest) | {"bases": geometry.bases, "displacement": still}))

    def increment(
        self,
        problem: Problem,
        state: ContactState,
        a: ObjectPose,
        b: ObjectPose,
        guess: Float | None,
        workspace: Workspace,
    ) -> ContactSolution:
        """Solve contact along the normals of the object."""
        assert isinstance(state, LinearState)
        body = LinearBody(problem.delassus, np.zeros_like(state.displacement))
        return solve_increment(problem, state, a, b, body, guess, workspace)

    def unknowns(self, problem: Problem, state: ContactState) -> Float:
        """Return the unknowns of one state."""
        return next(iter(self.all_unknowns(problem, [state])))

    def all_unknowns(self, problem: Problem, states: Sequence[ContactState]) -> Iterator[Float]:
        """Yield the unknowns from the forces, by one back-substitution for many states."""
        return problem.unknowns_of([problem.upright_force(state) for state in states])

    def readings(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Return the readings from the forces, by their rows."""
        return problem.read(problem.upright_force(state))

    def work_on_body(
        self, problem: Problem, before: ContactState, after: ContactState, a: ObjectPose, b: ObjectPose
    ) -> float:
        """Return the sum of the mean force of every point times its displacement."""
        assert isinstance(before, LinearState)
        assert isinstance(after, LinearState)
        force = 0.5 * (before.scene_force + after.scene_force)
        return float(np.sum(force * (after.displacement - before.displacement)))

    def moment(self, problem: Problem, state: ContactState, target: ObjectPose) -> Float:
        """Return the moment about the middle of the base, of forces at the centroids of their points at rest."""
        return moment_of(self.acting_places(problem, state), state.scene_force)

    def acting_places(self, problem: Problem, state: ContactState) -> Float:
        """Return the centroids of the points at rest."""
        return problem.surface.centroids

    def gap(self, problem: Problem, u: Float, target: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Return gaps and normals at the displaced points."""
        placed = problem.placed(target)
        geometry = contact_geometry(placed.distance, surface, surface.trace @ u, problem.axes)
        return geometry.gap, geometry.bases[:, 0]

    def may_touch(self, surface: BoundarySurface, normal: Float) -> NDArray[np.bool_]:
        """Return which points face the object at rest; see `finger3d.mechanics.contact_geometry.may_touch`."""
        return may_touch(surface, normal)

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Return displacement, linear strain and stress; in a section also the out-of-plane components."""
        from finger3d.fem.recover import displacement

        unknowns = self.unknowns(problem, state)
        return displacement(problem.mesh, unknowns), *problem.strain_and_stress(unknowns)
