"""Small-strain elasticity over the condensed compliance: the paper's model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from finger3d._types import Float
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.fem.recovery.recover import displacement
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.mechanics.discretise.contact_geometry import contact_geometry
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Loads, Workspace
from finger3d.mechanics.generalised import GeneralisedForces
from finger3d.mechanics.readings.columns import Column
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.linear_contact import LinearBody, solve_increment
from finger3d.objects import Move, ObjectPose


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
        return solve_increment(problem, state, move, body, guess, workspace, wanted)

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
