"""Formulation of the body, its strain measure and material response: small strain, which effects replace or wrap."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol

from finger3d._types import Float
from finger3d.contact.rules import RULES
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.mechanics.cost import AddedCost, PressCost

if TYPE_CHECKING:
    from finger3d.fem.traces import BoundarySurface
    from finger3d.mechanics.history import ObjectPose
    from finger3d.mechanics.model import Model
    from finger3d.mechanics.problem import Problem


@dataclass
class Workspace:
    """Factors and sparsity patterns that one increment leaves for the next; formulations add fields of their own.

    Several presses of one problem may share a workspace in turn, but not at once.

    Attributes
    ----------
    factorizations : number of factorisations made with this workspace
    """

    factorizations: int = 0


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
    supported_slots : frozenset of str
        Which of the model's slots ``inclusions`` and ``object_compliance`` the formulation accounts for.
    """

    @property
    def finite_strain(self) -> bool: ...

    @property
    def is_linear_elastic(self) -> bool: ...

    @property
    def refactorises(self) -> bool: ...

    @property
    def supported_slots(self) -> frozenset[str]: ...

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

    def gauges(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Strain of every gauge by name."""
        ...

    def gaps(
        self, problem: Problem, states: Sequence[ContactState], targets: Sequence[ObjectPose], face: BoundarySurface
    ) -> list[Float]:
        """Gap (c,) mm of any points of the contact face, candidates or not, in each state under its target."""
        ...

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Displacement (n, d) mm, strain (n, 3, 3) and stress (n, 3, 3) MPa at the nodes of the meshed part."""
        ...


def length_scale(problem: Problem, a: ObjectPose, b: ObjectPose) -> float:
    """Return the length (mm) that gaps are divided by: the depth, or that of the deepest leg during release."""
    return max(a.depth_mm, b.depth_mm) or max(leg.depth_mm for leg in problem.model.legs)


def solve_contact(
    problem: Problem,
    state: ContactState,
    free: Float,
    compliance: Float,
    scale: float,
    guess: Float | None,
    weights: Float | None = None,
) -> ContactSolution:
    """Solve one increment by the model's stick rule and friction law; see `finger3d.contact.solve.solve_increment`."""
    model = problem.model
    return RULES[model.rule](state, free, compliance, model.friction, scale, guess, weights, problem.surface.area)


@dataclass(frozen=True)
class SmallStrain:
    """Linear elasticity over the condensed compliance: the paper's baseline."""

    finite_strain: ClassVar[bool] = False
    is_linear_elastic: ClassVar[bool] = True
    supported_slots: ClassVar[frozenset[str]] = frozenset({"inclusions", "object_compliance"})

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

    def start(self, problem: Problem) -> ContactState:
        """Return the state without forces, with the gaps at rest."""
        return ContactState.at_rest(problem.gap(problem.origin), problem.dim)

    def increment(
        self,
        problem: Problem,
        state: ContactState,
        a: ObjectPose,
        b: ObjectPose,
        guess: Float | None,
        workspace: Workspace,
    ) -> ContactSolution:
        """Apply the contact rule once."""
        return solve_contact(
            problem, state, problem.free_motion(b), problem.delassus, length_scale(problem, a, b), guess
        )

    def unknowns(self, problem: Problem, state: ContactState) -> Float:
        """Return the unknowns of one state."""
        return next(iter(self.all_unknowns(problem, [state])))

    def all_unknowns(self, problem: Problem, states: Sequence[ContactState]) -> Iterator[Float]:
        """Yield the unknowns from the forces, by one back-substitution for many states."""
        return problem.unknowns_of([state.force for state in states])

    def gauges(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Return the strains from the forces, by the rows of the gauges."""
        return problem.gauge_strains(state.force)

    def gaps(
        self, problem: Problem, states: Sequence[ContactState], targets: Sequence[ObjectPose], face: BoundarySurface
    ) -> list[Float]:
        """Return the gaps at rest plus the displacement along the normal of the object."""
        from finger3d.fem.recover import displacement

        normal = problem.points.basis[0]
        return [
            problem.gap(target, face) + (face.trace @ displacement(problem.mesh, unknowns)) @ normal
            for target, unknowns in zip(targets, self.all_unknowns(problem, states), strict=True)
        ]

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Return displacement, linear strain and stress; in a section also the out-of-plane components."""
        from finger3d.fem.recover import across, displacement, nodal_strain, pressure, stress

        unknowns = self.unknowns(problem, state)
        u = displacement(problem.mesh, unknowns)
        strain = nodal_strain(problem.mesh, u)
        p = pressure(problem.mesh, problem.part.stiffness, unknowns) if problem.part.elastic.mixed else None
        sigma = stress(strain, problem.part.elastic, p)
        if problem.dim == 3:
            return u, strain, sigma
        material, plane_strain = problem.model.material, problem.model.domain == "plane-strain"
        return u, *across(strain, sigma, material, plane_strain)
