"""Variations of a condensed body: against its own proportions, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
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
    assert found.body is not None
    size = problem.surface.points.size
    force = np.random.default_rng(0).normal(size=size)
    moved, _ = found.body.of(problem, problem.unknowns(force.reshape(-1, 2))[:, None], force[:, None])
    assert moved[:, 0] == pytest.approx(-(problem.delassus.reshape(size, size) @ force) / e, rel=1e-5)


def test_what_changes_the_mesh_has_none() -> None:
    model = half_cylinder(0.3)
    other = replace(model, mesh=replace(model.mesh, size_mm=0.25))
    with pytest.raises(Finger3dError, match="changes the mesh"):
        variation(build(model), model, other, 1e-3)
