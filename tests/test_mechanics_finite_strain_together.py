"""One increment of several presses with one factor: each solution is that of the press alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from finger3d.contact.conditions import TOLERANCE
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.finite_strain.formulation import Beginning, FiniteStrain, increments
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.path import targets
from finger3d.objects import Move
from tests.models import half_cylinder

MUS = (0.3, 0.5, 0.8)


def test_solutions_found_together_are_those_found_alone() -> None:
    problem = build(LargeDeformation().apply(half_cylinder(1.0)))
    formulation = formulation_of(problem.model)
    assert isinstance(formulation, FiniteStrain)
    several = [replace(problem, model=replace(problem.model, friction=Coulomb(mu))) for mu in MUS]
    rest, move = formulation.start(problem), Move(problem.origin, targets(problem.model.legs)[0])
    workspace = formulation.workspace()
    beginnings = [Beginning(formulation, one, rest, None, move, workspace) for one in several]
    together = increments(beginnings, leader=1)
    alone = 0
    for one, found in zip(several, together, strict=True):
        assert found is not None
        assert found.residual <= TOLERANCE
        own = formulation.workspace()
        wanted = formulation.increment(one, rest, move, None, own)
        alone += own.factorizations
        # both are solved to a residual of 1e-8; forces follow to some times that
        np.testing.assert_allclose(
            found.state.contact.force,
            wanted.state.contact.force,
            atol=1e-6 * float(np.abs(wanted.state.contact.force).max()),
        )
    assert workspace.factorizations < alone
