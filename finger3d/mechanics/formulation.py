"""How a body answers to contact: the slot that small strain fills, and that effects replace or wrap."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.maeno import maeno_active_set
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactSolution, ContactState

if TYPE_CHECKING:
    from finger3d.fem.traces import BoundarySurface

Float = NDArray[np.float64]

RULES = {"projection": solve_increment, "paper": maeno_active_set}


class Formulation(Protocol):
    """What marching through a history asks of a body; `problem` is a `finger3d.mechanics.problem.Problem`.

    One that also answers for inclusions (`problem.springs`) says so by a class attribute ``inclusions = True``;
    one whose presses keep nothing in the problem, so that several may run at once, by ``independent = True``.

    Attributes
    ----------
    finite_strain : whether the strain measure is that of finite deformation; False for linear strain
    elastic : whether strain is linear and displacements follow from the contact forces alone (`Problem.unknowns_of`)

    Ask these rather than the class: the viscoelastic body is a subclass of `SmallStrain`, and not elastic.
    """

    finite_strain: ClassVar[bool]
    elastic: ClassVar[bool]

    def start(self, problem: Any) -> ContactState:
        """State at rest, before the first increment."""
        ...

    def increment(self, problem: Any, state: ContactState, a: Any, b: Any, guess: Float | None) -> ContactSolution:
        """Advance a state from target a to target b; `guess` (c, d) N is where the forces may start."""
        ...

    def unknowns(self, problem: Any, state: ContactState) -> Float:
        """All unknowns (N,) of the meshed part in a state."""
        ...

    def all_unknowns(self, problem: Any, states: Sequence[ContactState]) -> Iterator[Float]:
        """The same in each of several states, which may cost less than one after another."""
        ...

    def gauges(self, problem: Any, state: ContactState) -> dict[str, float]:
        """Strain of every gauge by name."""
        ...

    def gaps(
        self, problem: Any, states: Sequence[ContactState], targets: Sequence[Any], face: BoundarySurface
    ) -> list[Float]:
        """Gap (c,) mm of any points of the contact face, candidates or not, in each state under its target."""
        ...

    def fields(self, problem: Any, state: ContactState) -> tuple[Float, Float, Float]:
        """Displacement (n, d) mm, strain (n, 3, 3) and stress (n, 3, 3) MPa at the nodes of the meshed part."""
        ...


def length_scale(problem: Any, a: Any, b: Any) -> float:
    """What gaps are measured by (mm): the depth, or that of the deepest leg while the finger is let go."""
    return max(a.depth_mm, b.depth_mm) or max(leg.depth_mm for leg in problem.model.legs)


@dataclass(frozen=True)
class SmallStrain:
    """Linear elasticity over the condensed compliance: the paper's baseline."""

    finite_strain: ClassVar[bool] = False
    elastic: ClassVar[bool] = True
    inclusions: ClassVar[bool] = True
    object_compliance: ClassVar[bool] = True
    independent: ClassVar[bool] = True

    def start(self, problem: Any) -> ContactState:
        """No force, gaps at rest."""
        return ContactState.at_rest(problem.gap(problem.origin), problem.dim)

    def increment(self, problem: Any, state: ContactState, a: Any, b: Any, guess: Float | None) -> ContactSolution:
        """One call of the contact rule."""
        rule = RULES[problem.model.rule]
        scale = length_scale(problem, a, b)
        return rule(state, problem.free_motion(b), problem.delassus, problem.model.friction, scale, guess)

    def unknowns(self, problem: Any, state: ContactState) -> Float:
        """Those of one state."""
        return next(iter(self.all_unknowns(problem, [state])))

    def all_unknowns(self, problem: Any, states: Sequence[ContactState]) -> Iterator[Float]:
        """From the forces, with the factor at hand: one back-substitution for many states."""
        return problem.unknowns_of([state.force for state in states])

    def gauges(self, problem: Any, state: ContactState) -> dict[str, float]:
        """From the forces, through the gauges' rows."""
        return problem.gauge_strains(state.force)

    def gaps(
        self, problem: Any, states: Sequence[ContactState], targets: Sequence[Any], face: BoundarySurface
    ) -> list[Float]:
        """Gap at rest, changed by the displacement along the object's normal."""
        from finger3d.fem.recover import displacement

        normal = problem.points.basis[0]
        return [
            problem.gap(target, face) + (face.trace @ displacement(problem.mesh, unknowns)) @ normal
            for target, unknowns in zip(targets, self.all_unknowns(problem, states), strict=True)
        ]

    def fields(self, problem: Any, state: ContactState) -> tuple[Float, Float, Float]:
        """Linear strain and stress; a section gets the component across it that its assumption implies."""
        from finger3d.fem.recover import across, displacement, nodal_strain, pressure, stress

        unknowns = self.unknowns(problem, state)
        u = displacement(problem.mesh, unknowns)
        strain = nodal_strain(problem.mesh, u)
        p = pressure(problem.mesh, problem.stiffness, unknowns) if problem.elastic.mixed else None
        sigma = stress(strain, problem.elastic, p)
        if problem.dim == 3:
            return u, strain, sigma
        material, plane_strain = problem.model.material, problem.model.domain == "plane-strain"
        return u, *across(strain, sigma, material.E_MPa, material.nu, plane_strain)
