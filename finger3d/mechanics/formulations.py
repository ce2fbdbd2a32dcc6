"""Choice of the formulation of the body by the model."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from finger3d._types import Float
from finger3d.contact.state import ContactSolution
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Formulation
from finger3d.mechanics.model import Model
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.elastic import SmallStrain
from finger3d.objects import Move


@runtime_checkable
class ReachesForce(Protocol):
    """A formulation that has increments to a normal force."""

    def increment_to_force(
        self, problem: Problem, start: tuple[State[Any], Float | None], move: Move, wanted: float, workspace: Any
    ) -> tuple[Move, ContactSolution[State[Any]]] | None:
        """Advance a state to a normal force; see `increment_to_force`."""


def formulation_of(model: Model) -> Formulation[Any, Any]:
    """Return the formulation of a model; only that which it needs is imported."""
    if model.hyperelastic_law is not None:
        from finger3d.mechanics.finite_strain.formulation import FiniteStrain

        return FiniteStrain(model.hyperelastic_law, model.relaxation)
    if model.relaxation is not None:
        from finger3d.mechanics.small_strain.viscoelastic import Viscoelastic

        return Viscoelastic(model.relaxation)
    return SmallStrain()


def increment_to_force(
    problem: Problem, start: tuple[State[Any], Float | None], move: Move, wanted: float, workspace: Any
) -> tuple[Move, ContactSolution[State[Any]]] | None:
    """Advance a state to a normal force, with the depth as an unknown of the iteration.

    Parameters
    ----------
    start : state before the increment, and (c, d) contact forces where the iteration begins, N
    move : to a depth where the iteration begins
    wanted : N

    Returns
    -------
    Motion to the depth of the force, and the solution; None where the iteration does not converge.  In small strain
    there is none with viscosity, where the increments define the solution.
    """
    formulation = formulation_of(problem.model)
    if not isinstance(formulation, ReachesForce):
        return None
    return formulation.increment_to_force(problem, start, move, wanted, workspace)
