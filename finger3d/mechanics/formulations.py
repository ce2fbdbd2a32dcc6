"""Choice of the formulation of the body by the model."""

from __future__ import annotations

from typing import Any

from finger3d.mechanics.formulation import Formulation
from finger3d.mechanics.model import Model
from finger3d.mechanics.small_strain import SmallStrain


def formulation_of(model: Model) -> Formulation[Any, Any]:
    """Return the formulation of a model; only that which it needs is imported."""
    if model.hyperelastic_law is not None:
        from finger3d.mechanics.finite_strain.formulation import FiniteStrain

        return FiniteStrain(model.hyperelastic_law, model.relaxation)
    if model.relaxation is not None:
        from finger3d.mechanics.viscoelastic import Viscoelastic

        return Viscoelastic(model.relaxation)
    return SmallStrain()
