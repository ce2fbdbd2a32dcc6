"""Small-strain elasticity over the condensed compliance."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import Plane
from tests.models import block, run

COARSE = MeshOptions(1.5, 1.5, "swept")


@pytest.mark.parametrize("domain", ["solid", "plane-strain", "plane-stress"])
def test_fields_of_uniaxial_compression_are_uniform(domain: str) -> None:
    """With nu = 0 a flat press without friction is uniaxial: strain depth over height, stress E times that."""
    flat = {"object": Plane(), "material": Isotropic(2.0, 0.0), "friction": Coulomb(0.0), "domain": domain}
    problem, frames = run(block(mesh=COARSE, legs=(Leg(0.3, steps=1),), **flat))
    u, strain, stress = formulation_of(problem.model).fields(problem, frames[-1].meshed_state)
    assert u[:, 1] == pytest.approx(-0.1 * problem.mesh.points[:, 1], abs=1e-9)
    uniform = np.zeros((3, 3))
    uniform[1, 1] = -0.1
    assert np.allclose(strain, uniform, atol=1e-8)
    assert np.allclose(stress, 2.0 * uniform, atol=1e-8)


def test_the_work_of_one_proportional_press_is_the_strain_energy() -> None:
    problem, frames = run(block(mesh=COARSE, legs=(Leg(0.2, steps=1),)))
    formulation, state = formulation_of(problem.model), frames[-1].meshed_state
    start = formulation.start(problem)
    before, loads = (
        formulation.loads(problem, start, problem.origin),
        formulation.loads(problem, state, frames[-1].target),
    )
    work = loads.work_from(before)
    x = next(formulation.unknowns(problem, [state]))
    upper = problem.body.stiffness.upper
    energy = 0.5 * x @ ((upper + sp.triu(upper, 1).T) @ x)
    assert work == pytest.approx(energy, rel=1e-9)
    # the moment on a quarter: its force along y at the centroids of its points
    moment, state = loads.moment, state.contact
    assert moment[2] == pytest.approx((problem.surface.centroids[:, 0] * state.scene_force[:, 1]).sum()
                                      - (problem.surface.centroids[:, 1] * state.scene_force[:, 0]).sum())  # fmt: skip
