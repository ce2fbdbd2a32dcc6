"""Choice of the formulation."""

from __future__ import annotations

from dataclasses import replace

from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.mechanics.finite_strain.formulation import FiniteStrain
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.model import Leg
from finger3d.mechanics.small_strain.elastic import SmallStrain
from finger3d.mechanics.small_strain.viscoelastic import Viscoelastic
from tests.models import half_cylinder


def test_the_model_determines_its_formulation() -> None:
    model = replace(half_cylinder(1.0), legs=(Leg(0.5, steps=1, duration_s=1.0),))
    relaxing = Viscosity(((0.3, 0.5),)).apply(model)
    assert isinstance(formulation_of(model), SmallStrain)
    assert isinstance(formulation_of(relaxing), Viscoelastic)
    for finite in (LargeDeformation().apply(model), LargeDeformation().apply(relaxing)):
        formulation = formulation_of(finite)
        assert isinstance(formulation, FiniteStrain)
        assert formulation.relaxation == finite.relaxation
