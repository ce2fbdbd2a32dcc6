"""Choice of the formulation of the body by the model, and the places of its forces."""

from __future__ import annotations

from typing import Any

from finger3d._types import Float
from finger3d.fem.recover import displacement
from finger3d.mechanics.formulation import Formulation
from finger3d.mechanics.model import Model
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.small_strain import SmallStrain
from finger3d.mechanics.state import State


def formulation_of(model: Model) -> Formulation[Any, Any]:
    """Return the formulation of a model; only that which it needs is imported."""
    if model.hyperelastic_law is not None:
        from finger3d.mechanics.finite_strain import FiniteStrain

        return FiniteStrain(model.hyperelastic_law, model.relaxation)
    if model.relaxation is not None:
        from finger3d.mechanics.viscoelastic import Viscoelastic

        return Viscoelastic(model.relaxation)
    return SmallStrain()


def acting_places(problem: Problem, state: State[Any]) -> Float:
    """Return the places (m, d) mm where the forces on the whole finger's contact points act, from the part's state.

    They are the centroids of the points' hat functions: at rest in small strain, else on the deformed surface.
    """
    places = problem.surface.centroids
    if problem.model.finite_strain:
        unknowns = next(formulation_of(problem.model).unknowns(problem, [state]))
        places = places + problem.surface.trace @ displacement(problem.mesh, unknowns)
    return problem.symmetry.unfold_places(places, problem.points.points)
