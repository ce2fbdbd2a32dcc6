"""Finite strain through the whole solver: the Fig. 9 finger, limits, invariances."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.effects.embedded_gauge import Effect as EmbeddedGauge
from finger3d.effects.large_deformation import Effect
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.errors import Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.simplex import FREE_FACES
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import check_surface
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, Plane
from tests.models import block, large_fig9, last


def test_fig9_agrees_with_calculix() -> None:
    # validation/REFERENCES.md, 6.5: 28.5 N per mm by CalculiX, and 22.35 in small strain; stick zone 33 mm
    problem = build(large_fig9(0.45, 1.0))
    workspace = formulation_of(problem.model).workspace()
    *_, end = march(problem, workspace=workspace)
    got = measure(problem.points, end)
    assert end.outcome is Outcome.CONVERGED
    assert got["normal_force_N"] / 20.0 == pytest.approx(28.5, rel=0.02)
    assert 30.0 <= got["stick_half_length_mm"] <= 36.0
    assert abs(got["tangential_force_x_N"]) < 1e-9
    assert got["gauges"]["g"] == pytest.approx(got["gauges"]["mirror"], rel=1e-9)
    assert workspace.factorizations > 9


def test_incompressible_plane_stress_converges_to_the_limit_of_nu() -> None:
    forces = []
    for nu in (0.499, 0.4999, 0.5):
        problem = build(large_fig9(nu, 4.0, domain="plane-stress", legs=(Leg(3.0, steps=3),)))
        workspace = formulation_of(problem.model).workspace()
        *_, end = march(problem, workspace=workspace)
        assert end.outcome is Outcome.CONVERGED
        forces.append(measure(problem.points, end)["normal_force_N"])
        assert workspace.factorizations <= 5 * 3
    # linear in 0.5 - nu, so extrapolation from the first two leaves the square: 1e-6 and a factor
    assert forces[2] == pytest.approx(forces[1] + (forces[1] - forces[0]) / 9.0, rel=1e-5)


def test_half_the_height() -> None:
    # the contact reaches the corner of the section on the way; nu = 0.5 in the test above is the mixed form
    problem = build(large_fig9(0.45, 4.0, legs=(Leg(25.0, steps=12),)))
    frames = list(march(problem))
    assert frames[-1].outcome.ok
    forces = np.array([measure(problem.points, f)["normal_force_N"] for f in frames])
    assert np.all(np.diff(forces, 2) > -0.05 * forces[-1])  # it stiffens


def test_slide_of_several_contact_lengths_reaches_mu_n() -> None:
    finger = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    model = Model(
        finger, Isotropic(1.0, 0.45), MeshOptions(0.3, 1.0), (Leg(0.3, steps=3), Leg(0.3, slide_x_mm=4.0, steps=20)),
        object=Plane(), friction=Coulomb(0.3), domain="plane-strain",
    )  # fmt: skip
    problem = build(Effect().apply(model), margin=np.inf)
    *_, end = march(problem)
    got = measure(problem.points, end)
    assert end.outcome.ok
    assert got["tangential_force_x_N"] == pytest.approx(0.3 * got["normal_force_N"], rel=1e-8)


def test_a_cylinder_is_pressed_past_its_equator() -> None:
    # the dent is 3.5 times as deep as the cylinder is wide at its equator, where its walls become vertical
    body = designs()["block"](half_length_mm=10.0, height_mm=10.0, width_mm=1.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(0.25, 2.0, "swept"), (Leg(3.5, steps=14),),
        object=Cylinder(radius_mm=1.0), friction=Coulomb(0.2), domain="plane-strain",
    )  # fmt: skip
    problem = build(Effect().apply(model))
    *_, end = march(problem)
    assert end.outcome.ok
    assert end.state.bases is not None
    touching = end.state.force[:, 0] > 0.0
    assert end.state.bases[touching, 0, 1].max() > -0.35  # normals up to 70 degrees from the vertical
    (check,) = check_surface(problem, [end])
    assert check.within_candidates
    assert check.penetration_mm < 0.01 * 3.5


def test_a_bonded_block_folds_over() -> None:
    # walls roll onto the plane (validation/REFERENCES.md, 6.5); frictionless plates would let them bulge only
    body = designs()["block"](half_length_mm=5.0, height_mm=10.0, width_mm=1.0)
    model = Model(
        body, Isotropic(1.0, 0.45), MeshOptions(0.5, 1.0, "swept"), (Leg(3.0, steps=8),),
        friction=Coulomb(1.0), domain="plane-strain",
    )  # fmt: skip
    problem = build(Effect().apply(model), margin=np.inf)
    frames = list(march(problem))
    assert frames[-1].outcome.ok
    walls = problem.points.face == FREE_FACES.index("walls")
    touching = [np.count_nonzero(frame.state.force[walls, 0] > 0.0) for frame in frames]
    assert touching[2] < touching[-1]
    checks = check_surface(problem, frames)
    assert all(check.within_candidates for check in checks)
    assert max(check.penetration_mm for check in checks) < 0.03 * 3.0


@pytest.mark.slow
def test_a_press_too_deep_ends_in_an_outcome_with_all_earlier_steps_kept() -> None:
    problem = build(large_fig9(0.3, 8.0, legs=(Leg(48.0, steps=6),)))
    frames = list(march(problem))
    assert frames[0].outcome.ok
    assert frames[-1].outcome in {Outcome.NEWTON, Outcome.NO_CONVERGENCE}
    assert all(f.outcome.ok for f in frames[:-1])
    assert "try" in str(frames[-1].outcome)


@pytest.mark.parametrize("friction", [0.3, 5.0])
def test_a_twist_is_that_of_small_strain_under_a_light_load(friction: float) -> None:
    """Strains of a percent: the moment differs by a few percent, sliding and sticking."""
    legs = (Leg(0.02, steps=1), Leg(0.02, turn_y=np.radians(0.5), steps=2))
    model = block(object=Plane(), legs=legs, mesh=MeshOptions(1.0, 1.5, "swept"), friction=Coulomb(friction))
    small, finite = last(model), last(Effect().apply(model))
    assert small["moment_y_Nmm"] > 0.1
    assert finite["moment_y_Nmm"] == pytest.approx(small["moment_y_Nmm"], rel=0.05)
    assert finite["normal_force_N"] == pytest.approx(small["normal_force_N"], rel=0.05)


FOIL = EmbeddedGauge(E_MPa=3000.0, thickness_mm=0.02, width_mm=2.0)
PAIRS = {
    "embedded gauge": FOIL,
    "viscosity": Viscosity(((0.3, 0.5),)),
    "viscosity of the shear modulus": Viscosity(((0.3, 0.5),), bulk=False),
    "elastic object": ElasticObject(2.0, 0.4),
    "ogden": None,
}


@pytest.mark.parametrize("name", PAIRS)
def test_every_effect_beside_it_is_that_of_small_strain_under_a_light_load(name: str) -> None:
    finger = designs()["half_cylinder"](radius_mm=5.0, width_mm=2.0)
    foil = Gauge("g", 0.0, 3.0, length_mm=2.0)
    differences = []
    for depth in (0.16, 0.04):
        model = Model(
            finger, Isotropic(1.0, 0.45), MeshOptions(0.4 * depth**0.5, 1.0, "swept"),
            (Leg(depth, steps=4, duration_s=1.0),),
            friction=Coulomb(0.25), domain="plane-strain", gauges=(foil,),
        )  # fmt: skip
        effect = PAIRS[name]
        plain = model if effect is None else effect.apply(model)
        settings = Effect(law="ogden", terms=((0.7, 3.0), (0.3, -1.5))) if effect is None else Effect()
        problems = build(plain), build(settings.apply(plain))
        small, large = (measure(problem.points, list(march(problem))[-1]) for problem in problems)
        force = large["normal_force_N"] / small["normal_force_N"] - 1.0
        differences.append((abs(force), abs(large["gauges"]["g"] / small["gauges"]["g"] - 1.0)))
    # strain and slope at the contact go with the root of the depth, their effect on force and gauge with the depth
    assert max(differences[0]) < 0.05
    assert all(after < 0.4 * before for before, after in zip(*differences, strict=True))
