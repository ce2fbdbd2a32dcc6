"""Choice of the formulation, the state of a press, and the places of its forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.mechanics.finite_strain import FiniteStrain
from finger3d.mechanics.formulations import acting_places, formulation_of
from finger3d.mechanics.model import Leg
from finger3d.mechanics.small_strain import SmallStrain
from finger3d.mechanics.viscoelastic import Viscoelastic
from tests.models import half_cylinder, run


def test_the_model_determines_its_formulation() -> None:
    model = replace(half_cylinder(1.0), legs=(Leg(0.5, steps=1, duration_s=1.0),))
    relaxing = Viscosity(((0.3, 0.5),)).apply(model)
    assert isinstance(formulation_of(model), SmallStrain)
    assert isinstance(formulation_of(relaxing), Viscoelastic)
    for finite in (LargeDeformation().apply(model), LargeDeformation().apply(relaxing)):
        formulation = formulation_of(finite)
        assert isinstance(formulation, FiniteStrain)
        assert formulation.relaxation == finite.relaxation


@pytest.mark.parametrize("finite", [False, True])
def test_forces_act_at_places_that_give_their_moment(finite: bool) -> None:
    model = replace(half_cylinder(1.0), legs=(Leg(0.5, slide_x_mm=0.1, steps=2),))
    problem, steps = run(LargeDeformation().apply(model) if finite else model)
    places = acting_places(problem, steps[-1].meshed_state)
    force = problem.world_force(steps[-1].meshed_state.contact)
    moment = np.cross(np.pad(places, ((0, 0), (0, 3 - places.shape[1]))), force).sum(axis=0)
    # at finite strain nodal forces act at nodes, so that the centroids of hats differ by the curvature within a facet
    assert moment[2] == pytest.approx(steps[-1].moment[2], rel=5e-3 if finite else 1e-9)
