"""A hyperelastic body with foils."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.effects.embedded_gauge import Effect as Foil
from finger3d.fem.laws import NeoHooke, Yeoh
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.solids.hyperelastic import Hyperelastic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.finite_strain.body import FiniteBody
from finger3d.mechanics.model import Gauge, MeshOptions
from tests.models import block

COARSE = MeshOptions(1.5, 1.5, "swept")


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_the_tangent_of_solid_and_foils_is_the_derivative_of_their_forces(nu: float) -> None:
    gauge = Gauge("g", 0.5, 1.5, 0.0, 0.3, 1.0)
    model = Foil(300.0, 0.02, 1.0).apply(block(mesh=COARSE, gauges=(gauge,)))
    problem = build(model)
    body = FiniteBody.of(problem, Hyperelastic.of(NeoHooke(0.4), nu, False))
    rng = np.random.default_rng(0)
    size = problem.mesh.points.size + (len(body.solid.pattern.vertices) if nu == 0.5 else 0)
    x, step, h = 0.01 * rng.normal(size=size), rng.normal(size=size), 1e-6
    difference = (body.internal_forces(x + h * step) - body.internal_forces(x - h * step)) / (2.0 * h)
    upper = body.tangent(x).upper
    whole = upper + sp.triu(upper, 1).T
    assert np.abs(whole @ step - difference).max() < 1e-6 * np.abs(difference).max()
    assert body.bars is not None
    assert np.abs(body.internal_forces(np.zeros(size))).max() < 1e-12


def test_an_unstable_law_names_the_stretches_that_are_reached() -> None:
    problem = build(block(mesh=COARSE))
    body = FiniteBody.of(problem, Hyperelastic.of(Yeoh(0.4, -0.5, 0.0), 0.3, False))
    stretched = (problem.mesh.points * np.array([0.8, -0.5, 0.0])).ravel()
    assert body.instability(np.zeros(len(stretched))) == ""
    assert "1.8" in body.instability(stretched)
    assert FiniteBody.of(problem, Hyperelastic.of(NeoHooke(0.4), 0.3, False)).instability(stretched) == ""


def test_an_unstable_law_of_several_materials_names_the_limits_of_each() -> None:
    """The shear modulus scales all stresses of a law, so that the strains at which it is unstable are the same."""
    problem, law = build(block(mesh=COARSE)), Yeoh(0.4, -0.5, 0.0)
    alone = FiniteBody.of(problem, Hyperelastic.of(law, 0.3, False))
    part = np.arange(alone.points) % 2
    both = FiniteBody.of(problem, Hyperelastic.of_parts(law, (Isotropic(1.0, 0.3), Isotropic(5.0, 0.3)), part))
    stretched = (problem.mesh.points * np.array([0.8, -0.5, 0.0])).ravel()
    assert both.instability(np.zeros(len(stretched))) == ""
    assert both.instability(stretched) == alone.instability(stretched) != ""
