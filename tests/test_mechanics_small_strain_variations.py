"""Variations of a condensed section: against sections condensed with the changed key, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.solids.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.small_strain.variations import variation
from tests.models import half_cylinder


def test_a_modulus_changes_the_compliance_in_inverse_proportion() -> None:
    # W = W_1 / E, so that dW / dE = -W / E
    model = replace(half_cylinder(0.3), symmetry=())
    problem = build(model)
    e, nu, step = model.material.E_MPa, model.material.nu, 1e-3
    low, high = (replace(model, material=Isotropic(e + sign * step, nu)) for sign in (-1.0, 1.0))
    found = variation(problem, low, high, step)
    slope = (found.high.delassus - found.low.delassus) / (2.0 * step)
    assert slope == pytest.approx(-problem.delassus / e, rel=1e-5, abs=1e-7 * abs(problem.delassus).max())


def test_what_changes_the_mesh_has_none() -> None:
    model = half_cylinder(0.3)
    other = replace(model, mesh=replace(model.mesh, size_mm=0.25))
    with pytest.raises(Finger3dError, match="changes the mesh or the object"):
        variation(build(model), model, other, 1e-3)
